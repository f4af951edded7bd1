"""The studio page in a real browser: the best place of the robot."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from joulepath import ConeOrientedPose, Cycle, Pose
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.report.bundle import attached_to
from joulepath.app.api.report.check import checked
from joulepath.optimizer.placement.mounts import about_z
from joulepath.optimizer.placement.moved_cycle import cycle_at
from joulepath.optimizer.problem.targets import members
from tests.app.live import ROOT, Server
from tests.browser.pages import (
    SHOWN,
    ask,
    fill_json,
    findings,
    opened,
    search_places,
    show_json,
    state,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

ROUNDING = 1e-9
"""Difference of a pose from the same one by the library [m, rad]: double precision, twice."""
EQUAL = 1e-3
"""Relative difference of an energy that was computed twice: at a place of the map, the arm
configurations are only likely the best, so the second one may be lower."""
DOWN = {"position": [0.5, 0.0, 0.4], "rotvec": [3.1416, 0, 0]}
CYCLE: dict[str, Any] = json.loads((ROOT / "examples/placement/two_tables.json").read_text())[
    "cycle"
]
EVERY_FORM: dict[str, Any] = {
    "robot": "ur5e",
    "start": {"pose": {"position": [-0.5, 0, 0.4], "rpy": [3.1, 0.1, 0], "frame": "base_link"}},
    "stops": [
        {
            "name": "lines",
            "target": {"any_of": [{"pose": DOWN}, {"q": [0, -1.5, 1.5, -1.5, -1.5, 0]}]},
            "approach": {"direction": [0, 0, -1], "frame": "base", "distance": 0.05},
            "retreat": {"direction": [0, 0, -1], "distance": 0.05},
        },
        {
            "name": "path",
            "path": {
                "points": [
                    {"position": [0.4, 0.1, 0.3], "quaternion": [0, 1, 0, 0]},
                    {"position": [0.4, 0.3, 0.3], "rotvec": [3.1416, 0, 0]},
                ]
            },
        },
        {
            "name": "cone",
            "target": {
                "pose": {
                    "position": [0.3, -0.4, 0.3],
                    "orientation": {
                        "cone": {"axis": [0, 0, 1], "direction": [0.1, 0, -1], "half_angle": 0.3}
                    },
                }
            },
        },
    ],
    "tool_cone": {
        "axis": [0, 0, 1],
        "direction": [0, 0.2, -1],
        "half_angle": 1.5,
        "frame": "base_link",
    },
    "scene": {
        "frame": "base_link",
        "obstacles": [
            {"name": "box", "shape": "box", "size": [0.1, 0.1, 0.1], "pose": DOWN | {}},
        ],
    },
}
CLICKED = """([x, y]) => {
    const { parts, camera, renderer } = studio.view;
    const at = camera.position.clone().set(x, y, 0.004).applyMatrix4(parts.places.matrixWorld);
    at.project(camera);
    const box = renderer.domElement.getBoundingClientRect();
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
}"""
"""Where a point of the map is seen."""
LOOKED = "() => !studio.state.run && ['shown', 'failed'].includes(studio.state.looked?.state)"


def open_panel(page: Page) -> None:
    page.locator("#place-robot").click()


def look_at(page: Page, name: str, value: str) -> None:
    """Types a number of the place under inspection."""
    cell = page.locator("#place-looked").get_by_label(name)
    cell.fill(value)
    cell.press("Enter")


@pytest.fixture(scope="module")
def found(browser: Browser, service: Server) -> Iterator[Page]:
    """The page with a map of nine places, one of them the robot's own."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        ask(page, CYCLE)
        search_places(page, 100, 30)
        expect(page.locator("#progress-text")).to_contain_text("s left")
        until(page, "() => studio.state.mapShown")
        until(page, LOOKED)
        yield page


def test_the_map_is_seen_and_its_best_place_is_looked_at(found: Page) -> None:
    answer = state(found, "mapShown.answer")
    best, nominal = answer["best"], answer["nominal"]
    assert best["energy"] <= nominal["energy"]
    looked = state(found, "looked")
    assert looked["energy"] == pytest.approx(best["energy"])
    there = looked["motion"]["asked"]
    assert same(cycle(there), cycle(best["cycles"][0]["request"]))
    # the drawn base is at the position of the answer
    drawn = found.evaluate("() => studio.view.parts.arms.matrix.elements.slice(12, 15)")
    assert drawn == pytest.approx(best["base"]["position"], abs=ROUNDING)
    expect(found.locator("#place-legend")).to_contain_text("Energy at each place")
    solved = [each for each in answer["map"] if each["energy"] is not None]
    tiles = found.evaluate("() => studio.view.parts.places.children[0].count")
    assert tiles == len(solved) > 0
    expect(found.locator("#best-place")).to_contain_text("current place")


def test_a_click_on_the_map_computes_there(found: Page) -> None:
    found.locator("#view").press("6")
    points = [each for each in state(found, "mapShown.answer")["map"] if each["energy"] is not None]
    point = max(points, key=lambda each: np.hypot(*each["base"]["position"][:2]))
    x, y, _ = point["base"]["position"]
    found.mouse.click(*found.evaluate(CLICKED, [x, y]))
    until(found, LOOKED)
    looked = state(found, "looked")
    assert [looked["pose"][3], looked["pose"][7]] == pytest.approx([x, y])
    assert looked["energy"] <= point["energy"] * (1 + EQUAL)
    expect(found.locator("#place-note")).to_contain_text("J at this place")


def test_the_base_is_dragged_and_its_joules_follow(found: Page) -> None:
    look_at(found, "Base x in mm", "0")
    look_at(found, "Base y in mm", "0")
    until(found, LOOKED)
    found.get_by_role("button", name="Drag the base").click()
    until(found, "() => studio.view.drag.handle.position.length() < 1e-9")
    x, y = found.evaluate(CLICKED, [0, 0])
    found.mouse.move(x, y)
    found.mouse.down()
    found.mouse.move(x + 12, y - 12, steps=4)
    until(found, "() => studio.state.looked.state === 'moving'")
    moved = state(found, "looked.pose")
    drawn = found.evaluate("() => studio.view.parts.arms.matrix.elements.slice(12, 14)")
    assert drawn == pytest.approx([moved[3], moved[7]]) and np.hypot(*drawn) > 1e-3
    found.mouse.up()
    until(found, LOOKED)
    expect(found.locator("#place-joules")).to_contain_text("than now")


def test_an_accepted_place_is_one_step_of_undo(found: Page) -> None:
    look_at(found, "Base x in mm", "-20")
    until(found, LOOKED)
    there = state(found, "looked.motion.asked")
    before = state(found, "request")
    energy = state(found, "looked.energy")
    answer = state(found, "answered.solution.id")
    found.locator("#accept-place").click()
    assert state(found, "request") == there != before
    # its energy is shown without another computation
    assert state(found, "stale") is False and state(found, "run") is None
    assert state(found, "answered.solution.energy.electrical.total") == energy
    open_panel(found)
    expect(found.locator("#map-stale")).to_contain_text("does not include")
    expect(found.locator("#place-legend")).to_have_count(0)
    found.locator("#undo").click()
    assert state(found, "request") == before and state(found, "stale") is False
    assert state(found, "answered.solution.id") == answer
    expect(found.locator("#place-legend")).to_be_visible()


def test_the_map_is_reported_on(found: Page) -> None:
    found.locator("#report-places > summary").click()
    menu = found.locator("#report-places")
    with found.expect_download() as download:
        menu.get_by_role("button", name="Page (HTML)").click()
    file = Path(download.value.path()).read_bytes()
    assert attached_to(file).answer["id"] == state(found, "mapShown.answer.id")
    assert checked(file, again=False, request_id="test").agrees


@pytest.mark.parametrize(("scheme", "width"), [("light", 1440), ("dark", 1440), ("light", 390)])
def test_axe_finds_nothing_serious(found: Page, scheme: Any, width: int) -> None:
    before = found.viewport_size
    assert before is not None
    found.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    found.set_viewport_size({"width": width, "height": 900})
    for tab in ("Task", "Picture", "Places") if width < 1000 else ("",):
        if tab:
            found.get_by_role("tab", name=tab, exact=True).click()
        assert findings(found) == []
    assert found.evaluate("() => document.documentElement.scrollWidth") <= width
    found.set_viewport_size(before)
    found.emulate_media(color_scheme="light", reduced_motion="reduce")


def test_a_keyboard_is_enough(found: Page) -> None:
    found.locator("#map button").first.focus()
    found.keyboard.press("Enter")
    until(found, LOOKED)
    assert state(found, "looked.state") == "shown"
    found.locator("#region").get_by_label("x from in mm").focus()
    found.keyboard.press("Control+a")
    found.keyboard.insert_text("50")
    expect(found.locator("#search-places")).to_be_disabled()
    expect(found.locator("#region")).to_contain_text("The range of x must contain 0")


def test_what_is_sent_is_what_the_library_says(browser: Browser, service: Server) -> None:
    """The page transforms every form of a pose to a moved and turned base as the library does."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        fill_json(page, EVERY_FORM)
        show_json(page, False)
        open_panel(page)
        look_at(page, "Base x in mm", "120")
        until(page, LOOKED)
        with page.expect_request("**/cycle") as sent:
            look_at(page, "Base yaw in °", "30")
        until(page, LOOKED)
        T = np.eye(4)
        T[:3, :3], T[0, 3] = about_z(np.pi / 6), 0.12
        assert same(cycle(json.loads(sent.value.post_data or "")), cycle_at(cycle(EVERY_FORM), T))


def cycle(body: Any) -> Cycle:
    """The cycle of a body of `POST /cycle`."""
    return to_cycle(CycleRequest.model_validate(body), 60)


def same(one: Cycle, other: Cycle) -> bool:
    """Whether two cycles are equal as seen from their bases."""
    first, second = numbers(one), numbers(other)
    return len(first) == len(second) and bool(np.allclose(first, second, rtol=0, atol=ROUNDING))


def numbers(given: Cycle) -> list[float]:
    """All numbers of a cycle that depend on the place of the base."""
    found = [given.arm.gravity, *(each.T_base_shape for each in given.arm.scene.obstacles)]
    if given.arm.tool_cone is not None:
        found.append(given.arm.tool_cone.direction)
    targets = [given.start]
    for stop in given.stops:
        targets.append(stop.target)
        found += [line.direction for line in (stop.approach, stop.retreat) if line is not None]
        if stop.path is not None:
            targets += [*stop.path.path.via, stop.path.goal]
    for each in (single for target in targets for single in members(target)):
        if isinstance(each, Pose):
            found.append(each.T)
        elif isinstance(each, ConeOrientedPose):
            found += [each.position, each.direction]
        else:
            found.append(each)
    return [float(value) for each in found for value in np.ravel(each)]
