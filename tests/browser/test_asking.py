"""The studio page in a real browser: requests by the task panel, by JSON and by hand, and
errors.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.live import ROOT, Server
from tests.app.requests import EXAMPLES, long_search, move
from tests.browser.pages import (
    FIRST,
    MESHES,
    SHOWN,
    ask,
    fill_json,
    findings,
    new_cell,
    opened,
    show_json,
    state,
    type_into,
    until,
)
from tests.browsers import BROWSER, MISSING

ROUNDING = 1e-9  # s; sums of times in double precision

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

GHOSTS = "() => studio.view.parts.ghosts.children.length"
# position of the last ghost's flange as drawn, and at the best goal so far
BEST = """() => {
    const { parts, chain } = studio.view;
    const flange = parts.ghosts.children.at(-1).children.at(-1).matrix.clone().transpose();
    const best = studio.state.run?.incumbents.at(-1)?.q_goal ?? studio.reached();
    return [flange.elements, chain.frames(best).at(-1)];
}"""


# number of shapes of payloads in the picture
CARRIED = """() => {
    let count = 0;
    for (const load of studio.view.arms[0].loads)
        if (load.visible) load.traverse(({ isMesh }) => { count += Boolean(isMesh); });
    return count;
}"""


def test_a_wrong_request_is_explained(page: Page) -> None:
    fill_json(page, {**FIRST, "sample_period": -1})
    page.locator("#optimise").click()
    expect(page.locator("#problem")).to_contain_text("sample_period")
    assert page.locator("#problem a").get_attribute("href") == "problems/invalid-request"
    for text in ("{", "3", '"x"', "null", "[]"):
        fill_json(page, text)
        expect(page.locator("#json-error")).to_contain_text("not a request")
        expect(page.locator("#optimise")).to_be_disabled()
    fill_json(page, FIRST)
    expect(page.locator("#json-error")).to_have_count(0)
    expect(page.locator("#problem")).to_have_count(0)
    expect(page.locator("#optimise")).to_be_enabled()


# values of wrong types, at places read by the form, the handles and the picture
WRONG: list[dict[str, Any]] = [
    {"start": 3},
    {"start": {"q": "x"}},
    {"payload": "x"},
    {"scene": {"obstacles": {}}},
    {"scene": {"obstacles": [3]}},
    {"scene": {"obstacles": [None]}},
    {
        "scene": {
            "obstacles": [{"name": "x", "shape": "box", "size": 3, "pose": FIRST["start"]["pose"]}]
        }
    },
    {"stops": 3},
    {"stops": [None]},
    {"logs": 3},
]


def test_values_of_wrong_types_are_shown(page: Page) -> None:
    """The panel keeps wrong values as sent from JSON, until the service reports the error."""
    for wrong in WRONG:
        body = {**FIRST, **wrong}
        fill_json(page, body)
        show_json(page, False)
        expect(page.locator("#targets")).to_be_attached()
        text = f"JSON.stringify({json.dumps(body)})"
        until(page, f"() => JSON.stringify(studio.state.request) === {text}")
        expect(page.locator("#problem")).to_have_count(0)
    fill_json(page, {**FIRST, "payload": "x"})
    page.locator("#optimise").click()
    expect(page.locator("#problem")).to_contain_text("payload")
    show_json(page, False)
    expect(page.get_by_label("Tool and payload").locator(".error").first).to_be_visible()
    fill_json(page, FIRST)
    show_json(page, False)


def test_the_panel_keeps_every_example(page: Page) -> None:
    """The panel leaves an example unchanged, and an edit in the panel reaches the request."""
    for name, body in EXAMPLES.items():
        fill_json(page, body)
        show_json(page, False)
        assert state(page, "request") == body, name
        page.locator("#more > summary").click()
        type_into(page, "/deadline", "77")
        assert state(page, "request") == body | {"deadline": 77}, name
        page.locator("#undo").click()
        assert state(page, "request") == body, name
    fill_json(page, move())
    show_json(page, False)
    type_into(page, "/start/q/1", "-90")
    assert state(page, "request")["start"]["q"][1] == pytest.approx(-np.pi / 2)
    assert page.locator("[data-pointer='/start/q/1']").input_value() == "-90"
    type_into(page, "/payload/mass", "1,5")
    assert state(page, "request")["payload"]["mass"] == 1.5
    type_into(page, "/payload/mass", "many")
    expect(page.get_by_label("Tool and payload")).to_contain_text("Not a number")
    assert state(page, "request")["payload"]["mass"] == 1.5
    type_into(page, "/payload/mass", "0")
    assert "payload" not in state(page, "request")


def test_a_goal_is_dragged_and_a_box_is_drawn(browser: Browser, service: Server) -> None:
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        tools = page.get_by_role("toolbar", name="Editing in the picture")
        tools.get_by_role("button", name="Drag").click()
        page.locator("#drag").select_option("/goal")
        until(page, "() => studio.view.drag.handle.position.length() > 0")
        x, y = page.evaluate("""() => {
            const at = studio.view.drag.handle.position.clone().project(studio.view.camera);
            const box = studio.view.renderer.domElement.getBoundingClientRect();
            return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
        }""")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 8, y - 8, steps=3)
        # at once, with the button held: in words, and as a ghost at the pose of the hand
        expect(page.locator("#drag-note")).to_contain_text("Reached by")
        until(page, f"() => ({GHOSTS})() === 3")
        drawn, chain = page.evaluate(BEST)
        assert drawn == pytest.approx(chain)
        page.mouse.move(x, y - 700, steps=3)
        expect(page.locator("#drag-note")).to_contain_text("out of reach")
        until(page, "() => studio.reached() === null")
        page.mouse.move(x - 8, y - 8, steps=3)
        page.mouse.up()
        expect(page.locator("#drag-note")).to_contain_text("Reached by")
        moved = state(page, "request.goal.pose.position")
        assert 1e-3 < np.linalg.norm(np.subtract(moved, FIRST["goal"]["pose"]["position"])) < 0.2
        page.locator("#draw-box").click()
        box = page.locator("#view").bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] * 0.4, box["y"] + box["height"] * 0.8
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 30, y + 20, steps=3)
        page.mouse.up()
        drawn = state(page, "request.scene.obstacles")[-1]
        assert drawn["name"] == "box 1" and min(drawn["size"]) > 0
        count = len(FIRST["scene"]["obstacles"]) + 1
        assert page.evaluate("() => studio.view.parts.obstacles.children.length") == count


def test_progress_is_shown_and_cancelled(page: Page, service: Server) -> None:
    """A search of minutes shows its best energy so far, and a cancel frees its worker."""
    fill_json(page, long_search(100.0))
    page.locator("#optimise").click()
    expect(page.locator("#progress-text")).to_contain_text("Best so far")
    # the goal and the best goal so far, at the positions reported by the service
    until(page, "() => Boolean(studio.state.run?.incumbents.length)")
    drawn, chain = page.evaluate(BEST)
    assert drawn == pytest.approx(chain)
    page.locator("#cancel").click()
    expect(page.locator("#status")).to_have_text("Cancelled.")
    assert state(page, "run") is None
    assert service.post("/optimize", move()).status_code == 200


def test_a_cycle_is_played_as_one(browser: Browser, service: Server, page: Page) -> None:
    body = json.loads((ROOT / "examples" / "cycle" / "press_tending.json").read_text())
    ask(page, body)
    expect(page.locator("#timeline .leg").first).to_be_visible()
    legs = state(page, "answered.cycle.legs")
    assert page.locator("#timeline .leg").count() == len(legs)
    t, q = (
        np.array(state(page, "answered.solution.trajectory.t")),
        np.array(state(page, "answered.solution.trajectory.q")),
    )
    assert (
        t[0] == 0
        and t[-1] == pytest.approx(state(page, "answered.cycle.duration"))
        and (np.diff(t) > -ROUNDING).all()
    )
    assert np.abs(np.diff(q, axis=0)).max() < 0.1
    assert page.locator("#legs tbody tr").count() == len(legs)
    for k, leg in enumerate(legs):
        page.locator("#timeline .leg").nth(k).click()
        assert state(page, "time") == pytest.approx(leg["t0"])
        assert page.evaluate(CARRIED) == (1 if leg["payload_mass"] else 0), (
            "what it carries on this leg is drawn"
        )
    expect(page.locator(".label.stop", has_text="finished")).to_be_visible()
    kept = state(page, "answered.cycle.id")
    # every browser opens it with its request
    with opened(browser, f"{service.url}/studio#answer={kept}") as other:
        until(other, SHOWN)
        assert other.locator("#timeline .leg").count() == len(legs)
        assert state(other, "request") == body and not state(other, "stale")


def test_what_does_not_count_at_a_stop_is_faint(page: Page) -> None:
    """The grasped part is faint at its stop and on the lines in and out of it."""
    ask(page, json.loads((ROOT / "examples" / "cycle" / "out_of_a_tray.json").read_text()))
    names = page.evaluate(
        "() => studio.view.parts.obstacles.children.map(({ userData }) => userData.name)"
    )
    part = f"studio.view.parts.obstacles.children[{names.index('part')}]"
    faint = []
    for k, leg in enumerate(legs := state(page, "answered.cycle.legs")):
        page.locator("#timeline .leg").nth(k).click()
        assert state(page, "time") == pytest.approx(leg["t0"])
        page.evaluate("() => studio.view.render()")
        faint.append(page.evaluate(f"() => {part}.userData.material.opacity < 0.5"))
    assert faint == [
        leg["kind"] != "move" and leg["goal"]["stop"].startswith("pick") for leg in legs
    ]
    assert any(faint)


def test_a_page_stands_alone(browser: Browser, service: Server, tmp_path: Path) -> None:
    """The page is opened from a file, with no service and no network."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        page.locator("#export").click()
        with page.expect_download() as download:
            page.get_by_role("button", name="Stand-alone page").click()
        file = tmp_path / "motion.html"
        download.value.save_as(file)
        energy = page.locator("#joules").inner_text()
    with opened(browser, f"file://{file}", offline=True) as alone:
        until(alone, SHOWN)
        until(alone, MESHES)
        assert alone.locator("#joules").inner_text() == energy
        alone.get_by_role("tab", name="Use of limits").click()
        alone.locator("#limits button").first.click()
        assert np.isfinite(alone.evaluate("() => studio.tcp()")).all()
        expect(alone.locator("#task")).to_have_count(0)


def test_another_robot_begins_with_a_move_of_its_own(browser: Browser, service: Server) -> None:
    """It is chosen by keys alone, in a list that is named for readers of the screen."""
    with opened(browser, f"{service.url}/studio") as page:
        new_cell(page)
        page.locator("#change-robot").click()
        search = page.get_by_role("combobox", name="Search robots")
        expect(search).to_be_focused()
        # the list begins at the present robot, its last one, below the field
        expect(search).to_be_in_viewport()
        page.keyboard.type("kuka")
        chosen = page.get_by_role("listbox", name="Robots").locator("[aria-selected=true]")
        expect(chosen).to_contain_text("iiwa")
        page.keyboard.press("ArrowDown")
        expect(chosen).to_contain_text("KR 10")
        assert search.get_attribute("aria-activedescendant") == chosen.get_attribute("id")
        assert not findings(page)
        page.keyboard.press("Enter")
        until(page, "() => studio.state.request.robot === 'kr10_r1100'")
        move = service.get("/robots/kr10_r1100").json()["example_move"]
        assert state(page, "request.start.q") == move["start"]
        page.locator("#project > summary").click()
        page.locator("#examples").select_option(label="First move of this robot")
        until(page, SHOWN)
        assert state(page, "request") == {
            "robot": "kr10_r1100",
            "start": {"q": move["start"]},
            "goal": {"q": move["goal"]},
        }
        assert state(page, "answered.solution.robot") == "kr10_r1100"
