"""The studio page: a mistake leads to a sentence at its field, and no input is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.app.live import Server
from tests.browser.pages import (
    FIRST,
    SHOWN,
    fill_json,
    go,
    opened,
    optimised,
    show_json,
    state,
    type_into,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

OFFLINE = "status of (4|504)|ERR_INTERNET_DISCONNECTED"
CELL = "ancestor::*[self::section or self::li or contains(@class, 'target')][1]"
"""From a cell to the part of the form that it belongs to: a row of a table or a section."""


def part_of(cell: Locator) -> Locator:
    """The part of the form with this cell."""
    return cell.locator(f"xpath={CELL}")


@pytest.mark.parametrize(
    ("pointer", "text", "told"),
    [
        (
            "/goal/pose/position/0",
            "800000",
            "m out of reach in this orientation: move the position",
        ),
        ("/goal/pose/position/2", "1400", "out of reach in this orientation"),
        ("/payload/mass", "40", "exceeds the rated payload of the Universal Robots UR5e"),
        ("/payload/mass", "-1", "at least 0"),
        ("/scene/obstacles/0/pose/position/2", "200", "in collision"),
    ],
)
def test_each_mistake_leads_to_a_sentence_at_its_field(
    page: Page, pointer: str, text: str, told: str
) -> None:
    fill_json(page, FIRST)
    show_json(page, False)
    if pointer.startswith("/scene"):
        page.locator("#scene").get_by_role("button", name="table", exact=False).first.click()
    type_into(page, pointer, text)
    page.locator("#optimise").click()
    cell = page.locator(f"[data-pointer='{pointer}']")
    expect(part_of(cell)).to_contain_text(told)
    page.locator("#undo").click()


def test_a_group_that_is_shut_opens_for_its_mistake(page: Page) -> None:
    fill_json(page, {**FIRST, "gravity": [0, 0, -900]})
    show_json(page, False)
    group = page.locator("#more")
    group.evaluate("(group) => { group.open = false; }")
    page.locator("#optimise").click()
    expect(group.get_by_text("at least -100")).to_be_visible()


def test_without_the_service_nothing_is_lost(browser: Browser, service: Server) -> None:
    """A sentence appears at the button; the input is answered once the service is back."""
    url = f"{service.url}/studio"
    with opened(browser, url, tolerated=OFFLINE) as page:
        until(page, SHOWN)
        page.context.set_offline(True)
        type_into(page, "/payload/mass", "1.6")
        page.locator("#optimise").click()
        expect(page.locator("#problem")).to_contain_text("Your work is saved here")
        expect(page.locator("#problem")).to_contain_text("The service does not answer")
        expect(page.locator("#saved")).to_have_text("Saved in this browser")
        go(page, "Jobs")
        expect(page.locator("#jobs .error")).to_contain_text("The service does not answer")
        page.context.set_offline(False)
        # the list comes by itself
        expect(page.locator("#jobs .error")).to_have_count(0)
        go(page, "Cell")
        optimised(page)
        assert state(page, "answered.asked.payload.mass") == 1.6
        expect(page.locator("#problem")).to_have_count(0)


def test_numbers_that_are_none_are_refused_at_their_cells(page: Page) -> None:
    """The typed text stays, with a sentence, and nothing is computed until it is a number."""
    fill_json(page, FIRST)
    show_json(page, False)
    cell = page.locator("[data-pointer='/payload/mass']")
    type_into(page, "/payload/mass", "two")
    expect(cell).to_have_value("two")
    expect(cell).to_have_attribute("aria-invalid", "true")
    expect(part_of(cell)).to_contain_text("Not a number")
    assert state(page, "request.payload.mass") == FIRST["payload"]["mass"]
    expect(page.locator("#optimise")).to_be_disabled()
    expect(page.locator("#run-state")).to_contain_text("Enter a number")
    type_into(page, "/payload/mass", "-1")
    page.locator("#optimise").click()
    expect(page.locator("#form")).to_contain_text("at least 0")


def test_prices_and_times_that_are_none_are_refused_where_they_stand(page: Page) -> None:
    """The typed text stays, and the previous number counts until the next valid one."""
    fill_json(page, FIRST)
    show_json(page, False)
    optimised(page)
    page.get_by_role("button", name="Assumptions").click()
    price = page.get_by_label("Electricity in € per kWh")
    before = state(page, "economics.price.value")
    for text in ("abc", "-3"):
        price.fill(text)
        price.press("Enter")
        expect(price).to_have_value(text)
        expect(price).to_have_attribute("aria-invalid", "true")
        told = f"Enter a number of at least 0; until then, {before} is used."
        expect(page.locator("#assumptions .error")).to_have_text(told)
        assert state(page, "economics.price.value") == before
    price.fill("0,4")
    price.press("Enter")
    expect(page.locator("#assumptions .error")).to_have_count(0)
    assert state(page, "economics.price") == {"value": 0.4, "source": "yours"}
    every = page.get_by_label("Time per move or cycle")
    every.fill("0")
    every.press("Enter")
    expect(part_of(every).locator(".error")).to_have_text("Enter a number above 0.")
    every.fill("")
    every.press("Enter")
    expect(part_of(every).locator(".error")).to_have_count(0)
    assert state(page, "economics.cycleTime") is None


def test_what_the_service_cannot_tell_is_said_where_it_is_missing(
    browser: Browser, service: Server
) -> None:
    """An error is shown for the gripper and for every list, instead of an empty list."""
    with opened(browser, f"{service.url}/studio", tolerated=OFFLINE) as page:
        until(page, SHOWN)
        page.locator("#tool-fold > summary").click()
        expect(page.locator("#tool option")).to_have_count(6)
        page.context.set_offline(True)
        page.locator("#tool").select_option(label="OnRobot RG2")
        expect(part_of(page.locator("#tool"))).to_contain_text("this gripper could not be loaded")
        go(page, "Library")
        expect(page.locator("#library #problem")).to_contain_text("cannot be reached")
        for name in ("Answers", "Studies", "Your robots"):
            box = page.get_by_role("region", name=name)
            expect(box).to_be_visible()
            expect(box.get_by_text("yet")).to_have_count(0)
        page.context.set_offline(False)
        go(page, "Cell")
        type_into(page, "/payload/mass", "1.6")
        expect(page.locator("#tool-figures")).to_be_visible()


def test_a_file_that_is_no_arm_is_told_at_the_file(browser: Browser, service: Server) -> None:
    # Chromium's own report on invalid XML has a style forbidden by the page's policy.
    with opened(browser, f"{service.url}/studio", tolerated="Applying inline style") as page:
        until(page, SHOWN)
        page.locator("#change-robot").click()
        page.get_by_role("button", name="Add your own arm").click()
        arm = page.locator(".own-arm")
        for text in ("<robot/>", "not xml"):
            urdf = {"name": "own.urdf", "mimeType": "text/xml", "buffer": text.encode()}
            arm.get_by_label("URDF file").set_input_files(urdf)  # type: ignore[arg-type]
            arm.get_by_label("Largest payload, kg").fill("2")
            arm.get_by_role("button", name="Add the arm").click()
            told = arm.locator("label", has_text="URDF file").locator(".error")
            expect(told).to_have_text("The file describes no link: choose a URDF file.")
            expect(arm.locator(".error")).to_have_count(1)


def test_a_file_that_is_no_log_is_told_at_the_file(page: Page, tmp_path: Path) -> None:
    go(page, "Logs")
    file = tmp_path / "junk.csv"
    file.write_text("a,b\n1,2\n")
    page.locator("#log-file").set_input_files(file)
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Payload, kg").fill("two")
    page.locator("#add-log").click()
    expect(dialog.locator("[data-field=payload]")).to_have_text(
        "Enter a mass in kg, for example 1.5."
    )
    dialog.get_by_label("Payload, kg").fill("2")
    page.locator("#add-log").click()
    expect(dialog.locator("[data-field=file]")).to_be_visible()
    expect(dialog.locator(".error")).to_have_count(1)
    page.keyboard.press("Escape")
    go(page, "Cell")


def test_a_cycle_has_its_stops_again_after_a_look_at_one_move(page: Page) -> None:
    poses = [FIRST["goal"], FIRST["start"]]
    stops = [{"name": f"shelf {k}", "target": pose} for k, pose in enumerate(poses)]
    fill_json(page, {"start": FIRST["start"], "stops": stops, "closed": True})
    show_json(page, False)
    before = state(page, "request")
    for kind in ("Move", "Cycle"):
        page.get_by_role("radio", name=kind, exact=True).click()
    assert state(page, "request") == before
