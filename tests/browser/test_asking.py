"""The studio page in a real browser: how one asks, by form, by JSON and by hand, and what is said
of errors.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.live import ROOT, Server
from tests.app.requests import EXAMPLES, NEAR, long_search, move
from tests.browser.pages import FIRST, MESHES, SHOWN, ask, opened, show, state, until
from tests.browsers import BROWSER, MISSING

ROUNDING = 1e-9  # s; sums of times in double precision

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

GHOSTS = "() => studio.view.parts.ghosts.children.length"
# where the flange of the last ghost is drawn, and where it is at the best goal so far
BEST = """() => {
    const { parts, chain } = studio.view;
    const flange = parts.ghosts.children.at(-1).children.at(-1).matrix.clone().transpose();
    return [flange.elements, chain.frames(studio.state.best.q_goal).at(-1)];
}"""


# how many shapes of payloads are drawn now
CARRIED = """() => {
    let count = 0;
    for (const load of studio.view.arms[0].loads)
        if (load.visible) load.traverse(({ isMesh }) => { count += Boolean(isMesh); });
    return count;
}"""


def edit(page: Page, text: str) -> None:
    """Puts a text into the field of the request, whether it is seen or not."""
    page.locator("#json").evaluate(
        "(it, text) => { it.value = text; it.dispatchEvent(new Event('change')); }", text
    )


def test_a_wrong_request_is_explained(page: Page) -> None:
    show(page, "json")
    page.locator("#json").fill(json.dumps({**FIRST, "sample_period": -1}))
    page.locator("#json").blur()
    page.locator("#optimise").click()
    expect(page.locator("#problem")).to_contain_text("sample_period")
    assert page.locator("#problem a").get_attribute("href") == "problems/invalid-request"
    for text in ("{", "3", '"x"', "null", "[]"):
        edit(page, text)
        expect(page.locator("#problem")).to_contain_text("no request")
        expect(page.locator("#optimise")).to_be_disabled()
    edit(page, json.dumps(FIRST))
    expect(page.locator("#problem")).to_be_hidden()
    expect(page.locator("#optimise")).to_be_enabled()


# of wrong types, at places that the form, the handles and the picture read
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
    """Until the service says what is wrong with them, in the form as it is sent from JSON."""
    show(page, "form")
    for wrong in WRONG:
        edit(page, json.dumps({**FIRST, **wrong}))
        (name,) = wrong
        expect(page.locator(f"#form [data-path='{name}']")).to_be_attached()
        assert state(page, "request") == {**FIRST, **wrong}
        expect(page.locator("#problem")).to_be_hidden()
    show(page, "json")
    edit(page, json.dumps({**FIRST, "payload": "x"}))
    page.locator("#optimise").click()
    expect(page.locator("#problem")).to_contain_text("payload")
    show(page, "form")
    expect(page.locator("[data-path='payload'] .error")).to_be_visible()
    edit(page, json.dumps(FIRST))


def test_the_form_keeps_every_example(page: Page) -> None:
    """What the form shows, it does not change; what is changed in it comes back."""
    show(page, "form")
    for name, body in EXAMPLES.items():
        edit(page, json.dumps(body))
        until(page, "() => document.querySelectorAll('#form > .fields > *').length > 2")
        assert state(page, "request") == body, name
        field = page.get_by_label("deadline in s", exact=True)
        field.fill("77")
        field.blur()
        assert state(page, "request") == body | {"deadline": 77}, name
    field.fill(str(body["deadline"]))
    field.blur()
    assert state(page, "request") == body
    angle = page.locator("#form [data-path^='start.q'] input").nth(1)
    angle.fill("-90")
    angle.blur()
    assert state(page, "request")["start"]["q"][1] == pytest.approx(-np.pi / 2)
    page.get_by_label("Remove deadline").click()
    assert "deadline" not in state(page, "request")
    page.get_by_label("Add a field", exact=True).select_option("payload")
    assert state(page, "request")["payload"]["mass"] > 0


def test_an_error_stands_beside_its_field(page: Page) -> None:
    show(page, "form")
    page.get_by_label("Add a field to payload").select_option("shape")
    page.get_by_label("mass in kg").fill("-1")
    page.get_by_label("mass in kg").blur()
    page.locator("#optimise").click()
    expect(page.locator("[data-path='payload.mass'] .error")).to_be_visible()
    expect(page.locator("#form .error")).to_have_count(1)


def test_a_goal_is_dragged_and_a_box_is_drawn(browser: Browser, service: Server) -> None:
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        page.locator("#drag").select_option("goal")
        until(page, "() => studio.view.handle.position.length() > 0")
        x, y = page.evaluate("""() => {
            const at = studio.view.handle.position.clone().project(studio.view.camera);
            const box = studio.view.renderer.domElement.getBoundingClientRect();
            return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
        }""")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 8, y - 8, steps=3)
        # at once, while the button is held: in words, and as a ghost where the hand would be
        expect(page.locator("#drag-note")).to_contain_text("Reached by")
        until(page, f"() => ({GHOSTS})() === 3")
        drawn, chain = page.evaluate(BEST)
        assert drawn == pytest.approx(chain)
        page.mouse.move(x, y - 600, steps=3)
        expect(page.locator("#drag-note")).to_contain_text("out of reach")
        until(page, "() => studio.state.best === null")
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


def test_an_export_of_the_service_is_offered(page: Page) -> None:
    page.locator("#downloads > summary").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="urscript").click()
    assert "servoj" in Path(download.value.path()).read_text()
    expect(page.locator("#status")).to_contain_text("safety limits")


def test_progress_is_shown_and_cancelled(page: Page, service: Server) -> None:
    """The search of minutes tells its best energy; after a cancel its worker is free."""
    show(page, "json")
    page.locator("#json").fill(json.dumps(long_search(100.0)))
    page.locator("#json").blur()
    page.locator("#optimise").click()
    expect(page.locator("#progress-text")).to_contain_text("best")
    # start, goal, and the best goal so far, where the service says
    until(page, "() => Boolean(studio.state.best)")
    drawn, chain = page.evaluate(BEST)
    assert page.evaluate(GHOSTS) == 3 and drawn == pytest.approx(chain)
    page.locator("#cancel").click()
    expect(page.locator("#status")).to_have_text("Cancelled.")
    assert page.evaluate(GHOSTS) == 2
    assert service.post("/optimize", move()).status_code == 200


def test_a_cycle_is_played_as_one(browser: Browser, service: Server, page: Page) -> None:
    show(page, "json")
    page.locator("#json").fill((ROOT / "examples" / "cycle" / "press_tending.json").read_text())
    page.locator("#json").blur()
    page.locator("#optimise").click()
    expect(page.locator("#timeline .leg").first).to_be_visible()
    legs = state(page, "cycle.legs")
    assert page.locator("#timeline .leg").count() == len(legs)
    t, q = (
        np.array(state(page, "answer.trajectory.t")),
        np.array(state(page, "answer.trajectory.q")),
    )
    assert (
        t[0] == 0
        and t[-1] == pytest.approx(state(page, "cycle.duration"))
        and (np.diff(t) > -ROUNDING).all()
    )
    assert np.abs(np.diff(q, axis=0)).max() < 0.1
    assert page.locator("#timeline tbody tr").count() == len(legs)
    for k, leg in enumerate(legs):
        page.locator("#timeline .leg").nth(k).click()
        assert state(page, "time") == pytest.approx(leg["t0"])
        assert page.evaluate(CARRIED) == (1 if leg["payload_mass"] else 0), (
            "what it carries on this leg is drawn"
        )
    expect(page.locator(".label.stop", has_text="finished")).to_be_visible()
    kept = state(page, "cycle.answer").removeprefix("/answers/")
    with opened(browser, f"{service.url}/studio#answer={kept}") as other:
        until(other, SHOWN)
        assert other.locator("#timeline .leg").count() == len(legs)
        expect(other.locator("#optimise")).to_be_disabled()
        other.locator("#share").click()
        expect(other.locator("#status")).not_to_be_empty()
        assert other.url.endswith(f"#answer={kept}"), "its request is not known"


def test_what_does_not_count_at_a_stop_is_faint(page: Page) -> None:
    """The part that is grasped: at its stop and on the lines in and out of it."""
    ask(page, json.loads((ROOT / "examples" / "cycle" / "out_of_a_tray.json").read_text()))
    names = page.evaluate(
        "() => studio.view.parts.obstacles.children.map(({ userData }) => userData.name)"
    )
    part = f"studio.view.parts.obstacles.children[{names.index('part')}]"
    faint = []
    for k, leg in enumerate(legs := state(page, "cycle.legs")):
        page.locator("#timeline .leg").nth(k).click()
        assert state(page, "time") == pytest.approx(leg["t0"])
        page.evaluate("() => studio.view.render()")
        faint.append(page.evaluate(f"() => {part}.userData.material.opacity < 0.5"))
    assert faint == [
        leg["kind"] != "move" and leg["goal"]["stop"].startswith("pick") for leg in legs
    ]
    assert any(faint)


def test_what_is_kept_opens_again(page: Page, service: Server) -> None:
    """An answer of a study, and one that this browser has seen."""
    created = service.post("/studies", {"name": "press", "robot": "ur5e", "threshold": 60.0}).json()
    service.post(f"/studies/{created['id']}/iterations", {"optimize": move()})
    show(page, "kept")
    page.locator("#pane-kept li button", has_text="press").click()
    expect(page.get_by_role("button", name="← all")).to_be_visible()
    page.locator("#pane-kept li button").first.click()
    until(page, "() => studio.state.cycle === null")
    assert state(page, "answer.branch.goal.q") == pytest.approx(NEAR)
    page.get_by_role("button", name="← all").click()
    page.locator("#pane-kept li button", has_text=" J, ").nth(1).click()
    until(page, f"() => Math.abs(studio.state.answer.branch.goal.q[0] - {NEAR[0]}) > 0.01")


def test_a_page_stands_alone(browser: Browser, page: Page, tmp_path: Path) -> None:
    """Opened from a file, with no service and no network."""
    page.locator("#downloads > summary").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Page that stands alone").click()
    file = tmp_path / "motion.html"
    download.value.save_as(file)
    energy = page.locator("#joules").inner_text()
    with opened(browser, f"file://{file}", offline=True) as alone:
        until(alone, SHOWN)
        until(alone, MESHES)
        assert alone.locator("#joules").inner_text() == energy
        alone.locator("#limits button").first.click()
        assert np.isfinite(alone.evaluate("() => studio.tcp()")).all()
