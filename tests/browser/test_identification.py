"""The studio page in a real browser: from a log to figures, residuals, and a motion with them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from joulepath.optimizer.problem.robots import load_robot
from tests.app.live import ANSWER, CLIENT, Server
from tests.browser.pages import SHOWN, ask, go, opened, state, until
from tests.browser.test_reading import CONTRASTS, LEAST
from tests.browsers import BROWSER, MISSING
from tests.identification_logs import csv_of, recorded, truth_of

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

ROBOT = load_robot("ur5e")
TRUTH = truth_of(ROBOT)
# relative; the page shows three digits
DIGITS = 0.006
OPENED = "() => Boolean(document.getElementById('identification'))"


def add_log(page: Page, file: Path) -> None:
    """Chooses a file, and adds it as it is."""
    go(page, "Logs")
    page.locator("#log-file").set_input_files(file)
    page.locator("#add-log").click()


def last(service: Server) -> dict[str, Any]:
    """The newest identification, as answered by the service."""
    id = service.get("/identifications").json()["identifications"][0]["id"]
    found = service.get(f"/identifications/{id}").json()
    return dict(found) | service.get(f"/identifications/{id}/residuals").json()


def shown_rms(page: Page, name: str) -> float:
    """The residuals of one curve, as shown on the page."""
    title = page.locator("#identification h4", has_text=re.compile(rf"^{name}")).inner_text()
    found = re.search(r"residual ([\d.]+)", title)
    assert found is not None, title
    return float(found[1])


def rms(moves: list[dict[str, Any]], joint: int) -> float:
    pairs = [
        pair
        for move in moves
        for pair in zip(*(move["torque"][key][joint] for key in KEYS), strict=True)
    ]
    return float(
        np.sqrt(
            np.mean(
                [(measured - modelled) ** 2 for measured, modelled in pairs if modelled is not None]
            )
        )
    )


KEYS = ("measured", "modelled")


def test_a_log_becomes_figures_that_the_next_motion_has(
    page: Page, service: Server, tmp_path: Path
) -> None:
    file = tmp_path / "monday.csv"
    file.write_bytes(csv_of(recorded(ROBOT, TRUTH, moves=6)))
    add_log(page, file)
    expect(page.locator("#logs .content")).to_contain_text("No payload is given")
    page.locator("#identify").click()
    until(page, OPENED)
    found = last(service)
    assert found["state"] == "done"
    box = page.locator("#identification")
    expect(box.locator(".u-wrap")).to_have_count(ROBOT.nq + 1)
    assert shown_rms(page, "shoulder lift") == pytest.approx(rms(found["moves"], 1), rel=DIGITS)
    expect(box).to_contain_text("No payload is given")
    cells = box.locator("tr", has_text="torque, elbow").locator("td").all_inner_texts()
    fitted, own = (
        found["result"]["validation"][whose]["torque"]["relative"][2] for whose in ("fitted", "own")
    )
    assert [float(cell) for cell in cells[1:3]] == pytest.approx([fitted, own], rel=DIGITS)
    coulomb = next(
        each
        for each in found["result"]["parameters"]
        if (each["figure"], each["joint"]) == ("coulomb", 1)
    )
    cells = box.locator("tr", has_text="coulomb").nth(1).locator("td").all_inner_texts()
    assert cells[1] == "shoulder lift" and cells[5:] == ["B", "N·m"]
    told = [coulomb[name] for name in ("value", "sd", "previous")]
    assert [float(cell) for cell in cells[2:5]] == pytest.approx(told, rel=DIGITS)
    assert not [found for found in page.evaluate(CONTRASTS) if found[1] < LEAST]
    page.get_by_role("button", name="Use these figures").click()
    assert state(page, "request.figures") == found["figures"] and not page.evaluate(OPENED)
    # On a busy machine, the usual deadline may pass: these figures need a kernel of their own.
    ask(page, state(page, "request") | {"deadline": ANSWER})
    assert state(page, "answered.asked.figures") == found["figures"]


def test_moves_are_chosen_and_those_held_out_are_named(browser: Browser, service: Server) -> None:
    """On a phone, identifications are opened from the lists, after the deletion of their log."""
    with opened(browser, f"{service.url}/studio", viewport={"width": 390, "height": 844}) as page:
        until(page, SHOWN)
        body = csv_of(recorded(ROBOT, TRUTH, moves=4, seed=3), without="P")
        log = CLIENT.post(
            f"{service.url}/logs", content=body, headers={"Content-Type": "text/csv"}
        ).json()["id"]
        made = service.post(
            "/identifications", {"logs": [log], "validate": {"fraction": 0.5}}
        ).json()
        go(page, "Logs")
        newest = page.locator("#logs .side h2 ~ ul button").first
        newest.click()
        until(page, OPENED)
        assert CLIENT.delete(f"{service.url}/logs/{log}").status_code == 204
        page.get_by_role("button", name="Back to the logs").click()
        newest.click()
        expect(page.locator("#identification")).to_contain_text("This log was deleted.")
        found = last(service)
        assert found["id"] == made["id"]
        moves = sorted(found["moves"], key=lambda each: each["t"])
        options = page.get_by_label("Moves shown").locator("option")
        assert ["held out" in text for text in options.all_inner_texts()] == [
            False,
            *(m["held_out"] for m in moves),
        ]
        assert any(move["held_out"] for move in moves)
        for k in (0, 3):
            page.get_by_label("Moves shown").select_option(index=k + 1)
            assert shown_rms(page, "elbow") == pytest.approx(rms(moves[k : k + 1], 2), rel=DIGITS)
        assert page.locator("#identification .u-wrap").count() == ROBOT.nq, "no power was logged"
        width = page.evaluate("() => document.documentElement.scrollWidth")
        assert width <= 390, "the page is one column"
        go(page, "Cell")
        expect(page.locator("#view")).to_be_visible()


def test_what_a_log_does_not_tell_is_explained(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "short.csv"
    file.write_bytes(csv_of(recorded(ROBOT, TRUTH, moves=1)))
    add_log(page, file)
    expect(page.locator("#measured")).to_be_visible()
    while (ticked := page.locator("#logs .side input:checked")).count() > 1:
        ticked.last.uncheck()
    page.locator("#identify").click()
    expect(page.locator("#problem a")).to_have_attribute("href", "problems/nothing-held-out")
    assert not page.evaluate(OPENED)
    file.write_text("t,q1\n0,1\n")
    add_log(page, file)
    expect(page.get_by_role("dialog").locator(".error a")).to_have_attribute(
        "href", re.compile("problems/(validation|invalid-table)")
    )
    page.get_by_role("button", name="Close").click()


def test_measured_joules_stand_beside_those_that_are_predicted(
    page: Page, service: Server, tmp_path: Path
) -> None:
    """Measured and predicted energies are shown for every move of a log and for the whole log."""
    file = tmp_path / "tuesday.csv"
    file.write_bytes(csv_of(recorded(ROBOT, TRUTH, moves=3, seed=5)))
    add_log(page, file)
    expect(page.locator("#logs .content h2")).to_have_text("tuesday.csv")
    rows = page.locator("#measured tbody tr")
    expect(rows.first).to_contain_text("whole log")
    log = service.get("/logs").json()["logs"][0]["id"]
    found = service.post("/evaluate", {"log": log}).json()
    parts = [found["total"], *found["cycles"], *found["segments"]]
    assert rows.count() == len(parts)
    for part, row in zip(parts, rows.all(), strict=True):
        cells = [cell.replace(",", "") for cell in row.locator("td").all_inner_texts()]
        measured, predicted = part["measured"]["electrical"], part["energy"]["electrical"]["total"]
        assert float(cells[2]) == pytest.approx(measured, rel=DIGITS)
        assert float(cells[4]) == pytest.approx(predicted, rel=DIGITS)
        difference = float(cells[6].strip(" %").replace("−", "-"))
        assert difference == pytest.approx(100 * (measured / predicted - 1), rel=0.06, abs=0.01)
