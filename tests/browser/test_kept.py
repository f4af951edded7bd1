"""The studio page in a real browser: all kept things are renamed, found and deleted alike."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from uuid import uuid4

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.optimizer.problem.robots import load_robot
from tests.app.job_clients import evaluation
from tests.app.live import ANSWER, CLIENT, Server
from tests.browser.pages import SHOWN, go, opened, until
from tests.browsers import BROWSER, MISSING
from tests.identification_logs import csv_of, recorded, truth_of

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

ROBOT = load_robot("ur5e")
# every text shown of a running identification
NOTE_PROGRESS = """() => {
    window.told = [];
    new MutationObserver(() => {
        const text = document.querySelector("#identifying")?.innerText;
        if (text && text !== told.at(-1)) told.push(text);
    }).observe(document.body, { subtree: true, childList: true, characterData: true });
}"""


def add_log(service: Server, moves: int = 4) -> str:
    body = csv_of(recorded(ROBOT, truth_of(ROBOT), moves=moves, seed=8))
    answer = CLIENT.post(f"{service.url}/logs", content=body, headers={"Content-Type": "text/csv"})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def add_identification(service: Server) -> str:
    return str(service.post("/identifications", {"logs": [add_log(service)]}).json()["id"])


def add_job(service: Server) -> str:
    return str(service.post("/jobs", {"requests": [evaluation()]}).json()["id"])


def add_study(service: Server) -> str:
    return str(service.post("/studies", {"name": "A study", "threshold": 60.0}).json()["id"])


def add_robot(service: Server) -> str:
    name = f"arm_{uuid4().hex[:6]}"
    assert service.post("/robots", {"name": name, **ARM}).status_code == 201
    return name


KEPT: dict[str, tuple[Callable[[Server], str], str, str, str]] = {
    # how to make it, its page, its list, and its search field
    "studies": (add_study, "Library", "#studies li", "Search studies"),
    "robots": (add_robot, "Library", "#own-robots li", "Search your robots"),
    "jobs": (add_job, "Jobs", "#jobs .side li", "Search jobs"),
    "logs": (add_log, "Logs", "#logs .side ul:first-of-type li", "Search logs and identifications"),
    "identifications": (
        add_identification,
        "Logs",
        "#logs .side h2 ~ ul li",
        "Search logs and identifications",
    ),
}


@pytest.mark.parametrize("things", KEPT)
def test_it_is_renamed_found_and_deleted(browser: Browser, service: Server, things: str) -> None:
    add, where, rows, search = KEPT[things]
    made = add(service)
    path = f"/{things}/{made}"
    add(service)
    name = f"50% tray {uuid4().hex[:6]}"
    with opened(browser, f"{service.url}/studio", tolerated="status of 404|status of 504") as page:
        until(page, SHOWN)
        go(page, where)
        expect(page.locator(rows).nth(1)).to_be_visible()
        # robots are listed by their names
        by_name = page.locator(rows, has_text=made)
        row = by_name if things == "robots" else oldest_of_two(page, rows)
        rename(page, row, name)
        expect(page.locator(rows, has_text=name)).to_have_count(1)
        told: dict[str, Any] = service.get(path).json()
        assert told["title" if things == "robots" else "name"] == name
        page.get_by_label(search).fill(name.upper())
        expect(page.locator(rows)).to_have_count(1)
        expect(page.locator(rows)).to_contain_text(name)
        # Escape changes nothing
        page.locator(rows).get_by_role("button", name="Rename").click()
        page.get_by_label("New name of").fill("other")
        page.keyboard.press("Escape")
        expect(page.locator(rows)).to_contain_text(name)
        page.get_by_role("button", name=f"Delete {name}").click()
        expect(page.locator(rows)).to_have_count(0)
        assert service.get(path).status_code == 404


def oldest_of_two(page: Page, rows: str) -> Locator:
    """The older of the two items added by a test: lists are newest first."""
    return page.locator(rows).nth(1)


def rename(page: Page, row: Locator, name: str) -> None:
    row.get_by_role("button", name="Rename").click()
    page.get_by_label("New name of").fill(name)
    page.keyboard.press("Enter")


def test_a_project_is_renamed_where_it_is_found(browser: Browser, service: Server) -> None:
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        page.locator("#project > summary").click()
        page.get_by_role("button", name="Open a project").click()
        rows = page.get_by_role("dialog").locator("li")
        rename(page, rows.first, "Night cell")
        expect(rows.first).to_contain_text("Night cell")
        page.get_by_role("button", name="Close").click()
        expect(page.get_by_label("Name of the project")).to_have_value("Night cell")


def test_the_time_left_of_an_identification_is_told(browser: Browser, service: Server) -> None:
    """Twenty motions are held out in turn: of twenty-one fits, most are still ahead."""
    log = add_log(service, moves=20)
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        body = {"logs": [log], "validate": "moves", "deadline": ANSWER}
        job = service.post("/identifications", body).json()["id"]
        CLIENT.patch(f"{service.url}/identifications/{job}", json={"name": "Twenty-one fits"})
        page.evaluate(NOTE_PROGRESS)
        go(page, "Logs")
        page.get_by_role("button", name="Twenty-one fits", exact=False).first.click()
        expect(page.locator("#identification h2")).to_have_text("Twenty-one fits")
        told = page.evaluate("() => told")
        assert any(re.search("of the fits, about .* s left", text) for text in told), told
        expect(page.locator("#identifying")).to_have_count(0)
