"""The studio page in a real browser: nothing is stale, and nothing is lost."""

from __future__ import annotations

import json
import re
from pathlib import Path
from uuid import uuid4

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Route, expect

from joulepath.app.convert.arm import to_arm
from joulepath.app.schemas.arm import ArmRequest
from joulepath.optimizer.problem.tool import load_tool
from tests.app.live import Server
from tests.browser.pages import (
    FIRST,
    SHOWN,
    fill_json,
    go,
    new_cell,
    opened,
    optimised,
    show_json,
    state,
    type_into,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)


def test_figures_older_than_the_cell_are_marked(page: Page) -> None:
    """The picture hides the old motion, undo brings the answer back, and a reload loses nothing."""
    fill_json(page, FIRST)
    show_json(page, False)
    optimised(page)
    paths = "() => studio.view.parts.path.children.length"
    assert page.evaluate(paths) == 1
    type_into(page, "/goal/pose/position/2", "500")
    type_into(page, "/payload/mass", "1.6")
    expect(page.locator("#stale")).to_contain_text("Goal Z 450.0 mm → 500.0 mm")
    expect(page.locator("#stale")).to_contain_text("Payload 0.800 kg → 1.600 kg")
    expect(page.locator("#joules s")).to_have_count(1)
    expect(page.locator("#export")).to_be_disabled()
    expect(page.locator("#play")).to_be_disabled()
    assert page.evaluate(paths) == 0
    page.locator("#undo").click()
    page.locator("#undo").click()
    expect(page.locator("#stale")).to_have_count(0)
    assert page.evaluate(paths) == 1
    page.locator("#redo").click()
    typed = page.locator("[data-pointer='/goal/pose/position/2']")
    expect(typed).to_have_value("500")
    expect(page.locator("#saved")).to_have_text("Saved in this browser")
    page.reload()
    until(page, "() => Boolean(window.studio?.state.answered)")
    expect(typed).to_have_value("500")
    expect(page.locator("#stale")).to_contain_text("Goal Z")
    page.get_by_role("button", name="Undo change").click()
    expect(page.locator("#stale")).to_have_count(0)


def test_projects_are_named_saved_and_opened(
    browser: Browser, service: Server, tmp_path: Path
) -> None:
    """Projects are saved in the browser, and as files."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        page.get_by_label("Name of the project").fill("Night cell")
        page.get_by_label("Name of the project").blur()
        type_into(page, "/payload/mass", "1,25")
        with page.expect_download() as download:
            page.keyboard.press("Control+s")
        file = tmp_path / "night.joulepath.json"
        download.value.save_as(file)
        assert json.loads(file.read_text())["typed"]["/payload/mass"] == "1,25"
        new_cell(page)
        assert state(page, "project.name") == "New cell"
        page.locator("#project > summary").click()
        page.locator("#open-file").set_input_files(file)
        expect(page.locator("[data-pointer='/payload/mass']")).to_have_value("1,25")
        page.locator("#project > summary").click()
        page.get_by_role("button", name="Open a project").click()
        page.get_by_label("Search projects").fill("New")
        page.get_by_role("dialog").get_by_role("button", name="New cell").first.click()
        assert state(page, "project.name") == "New cell"


DROPPED = """([name, text]) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([text], name));
    const drop = new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true });
    return document.querySelector("#view").dispatchEvent(drop);
}"""


def test_a_file_that_is_dropped_is_opened_or_refused(browser: Browser, service: Server) -> None:
    """The browser itself would leave the page for the file. What the file holds in other types than
    a project does not count.
    """
    with opened(browser, f"{service.url}/studio", tolerated="is not a project") as page:
        until(page, SHOWN)
        for name, text, why in (
            ("photo.png", "\x89PNG", "Save as a file"),
            ("answer.json", '{"robot": "ur5e", "trajectory": {}}', "This is an answer"),
        ):
            assert page.evaluate(DROPPED, [name, text]) is False
            expect(page.locator("#problem")).to_contain_text(f"{name} is not a project")
            expect(page.locator("#problem")).to_contain_text(why)
        assert state(page, "request") == FIRST
        old = {"name": 5, "request": FIRST, "typed": {"/payload/mass": 5}, "economics": {"box": 3}}
        assert page.evaluate(DROPPED, ["old.json", json.dumps(old)]) is False
        expect(page.get_by_label("Name of the project")).to_have_value("old")
        optimised(page)
        expect(page.locator("#costs")).to_contain_text("€ per kWh")


def test_a_kept_answer_comes_back_as_it_was_typed(browser: Browser, service: Server) -> None:
    """Another browser opens the answer from the list: poses as poses, and numbers digit
    by digit.
    """
    name = f"Night cell {uuid4().hex[:6]}"
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        page.get_by_label("Name of the project").fill(name)
        page.get_by_label("Name of the project").blur()
        type_into(page, "/payload/mass", "1,2500")
        type_into(page, "/goal/pose/position/2", "449,125")
        optimised(page)
        asked = state(page, "request")
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        go(page, "Library")
        page.get_by_label("Search answers").fill(name)
        page.locator("#answers b", has_text=re.compile(f"^{name}$")).click()
        until(page, "() => studio.state.page === 'cell' && Boolean(studio.state.answered)")
        assert state(page, "request") == asked and not state(page, "stale")
        expect(page.locator("[data-pointer='/payload/mass']")).to_have_value("1,2500")
        expect(page.locator("[data-pointer='/goal/pose/position/2']")).to_have_value("449,125")


def test_what_is_typed_stays_while_poses_are_checked(page: Page) -> None:
    """The service answers one number while the user types the next."""
    fill_json(page, FIRST)
    show_json(page, False)
    row = page.locator("[data-row='/goal']")
    expect(row).to_contain_text("free")
    held: list[Route] = []
    page.route("**/ik", lambda route: held.append(route))
    type_into(page, "/goal/pose/position/2", "449,125")
    expect(row).to_contain_text("checking")
    cell = page.locator("[data-pointer='/goal/pose/position/0']")
    cell.fill("-351,5")
    while held:
        held.pop().continue_()
    expect(row).to_contain_text("free")
    expect(cell).to_have_value("-351,5")
    cell.press("Enter")
    assert state(page, "request.goal.pose.position") == [-0.3515, -0.52, 0.449125]
    page.unroute("**/ik")


def test_a_gripper_by_name_is_seen_and_counts(page: Page) -> None:
    """The gripper brings its TCP, shape and mass, with the letters of their sources."""
    fill_json(page, {"start": FIRST["start"], "goal": FIRST["goal"], "payload": FIRST["payload"]})
    show_json(page, False)
    page.locator("#tool-fold > summary").click()
    page.locator("#tool").select_option(label="Robotiq 2F-85")
    assert state(page, "request.tool") == "robotiq_2f_85"
    expect(page.locator("#tool-figures")).to_contain_text("0.900 kg C")
    expect(page.locator("[data-pointer='/tcp/position/2']")).to_have_value("142.0")
    optimised(page)
    flange = np.array(page.evaluate("() => studio.view.arms[0].frames.at(-1)")).reshape(4, 4)
    tcp = np.array(page.evaluate("() => studio.tcp()")).reshape(4, 4)
    assert np.linalg.norm(tcp[:3, 3] - flange[:3, 3]) == pytest.approx(0.142)
    meshes = "() => studio.view.arms[0].links.at(-1).children.length"
    assert page.evaluate(meshes) == 2, "the tool and the part"
    type_into(page, "/tcp/position/2", "150")
    assert state(page, "request.tcp.position") == [0, 0, 0.15]
    page.locator("#undo").click()
    page.locator("#tool").select_option("")
    assert state(page, "request.tool") is None


def test_a_part_of_known_size_needs_no_inertia(page: Page) -> None:
    """The part is gripped at the TCP, and the program sets part and gripper as one payload."""
    fill_json(page, {"start": FIRST["start"], "goal": FIRST["goal"], "tool": "robotiq_2f_85"})
    show_json(page, False)
    expect(page.locator("[data-pointer='/tcp/position/2']")).to_have_value("142.0")
    type_into(page, "/payload/mass", "2")
    tcp = load_tool("robotiq_2f_85").T_flange_tcp[:3, 3].tolist()
    assert state(page, "request.payload") == {"mass": 2, "com": tcp}
    page.locator(".payload-form > summary").click()
    page.get_by_label("Shape of the payload").select_option("cylinder")
    type_into(page, "/payload/shape/length", "80")
    given = state(page, "request.payload")
    assert given["shape"]["pose"]["position"] == tcp and "com" not in given
    optimised(page)
    sent = state(page, "answered.solution.arm")
    carried = to_arm(ArmRequest.model_validate(sent)).payload
    assert carried.mass == pytest.approx(2.9) and carried.inertia.any()
    page.locator("#export").click()
    page.locator("[data-format=movej]").click()
    centre = ", ".join(f"{each:.6g}" for each in carried.com.round(6) + 0.0)
    expect(page.locator("#preview")).to_contain_text(f"set_target_payload(2.9, [{centre}])")
    expect(page.locator(".steps")).to_contain_text("2.90 kg (gripper and part)")
    page.keyboard.press("Escape")
    page.get_by_role("radio", name="own centre", exact=True).click()
    assert state(page, "request.payload.com") == tcp
    expect(page.locator("[data-pointer='/payload/com/2']")).to_have_value("142.0")
    page.get_by_label("Shape of the payload").select_option("none")
    type_into(page, "/payload/mass", "4.5")
    expect(page.locator("#form")).to_contain_text("5.40 kg, gripper included, exceeds")
    type_into(page, "/payload/mass", "2")
    assert state(page, "request.payload") == {"mass": 2, "com": tcp, "shape": None}
