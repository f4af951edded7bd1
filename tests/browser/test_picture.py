"""The picture of the studio in a real browser: the arm, its motion and its scene as they are."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from joulepath import Arm, Pose, load_robot
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.app.live import Server
from tests.app.requests import move
from tests.browser.pages import (
    FIRST,
    MESHES,
    PIXELS,
    ROUNDING,
    SHOWN,
    ask,
    opened,
    state,
    tcp,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

DRAWN = 1e-6  # m; the certificate's own tolerance of an end


def test_the_picture_is_of_the_motion(page: Page) -> None:
    """At both ends, the TCP is drawn at the pose of the request."""
    for time, end in ((0.0, "start"), (state(page, "duration"), "goal")):
        pose = FIRST[end]["pose"]
        turn = "quaternion" if "quaternion" in pose else "rpy"
        asked = getattr(Pose, f"from_{turn}")(pose["position"], pose[turn])
        assert tcp(page, time) == pytest.approx(asked.T, abs=DRAWN)


def test_the_picture_is_where_the_library_says(page: Page) -> None:
    arm = Arm(
        robot=load_robot("ur5e"), T_flange_tcp=Pose.from_quaternion([0, 0, 0.16], [0, 0, 0, 1]).T
    )
    trajectory = state(page, "answered.solution.trajectory")
    for k in (10, 50, 90):
        assert tcp(page, trajectory["t"][k]) == pytest.approx(
            tcp_pose(arm, np.array(trajectory["q"][k])), abs=ROUNDING
        )


def test_something_is_drawn_and_switches_change_it(page: Page) -> None:
    share, before = page.evaluate(PIXELS)
    assert share > 0.05
    page.locator("#show > summary").click()
    seen = {before}
    for name in ("ghosts", "path", "nearest", "margins", "capsules", "axes"):
        page.locator(f"[data-show={name}]").click()
        _, now = page.evaluate(PIXELS)
        assert now not in seen, name
        seen.add(now)
    for name in ("ghosts", "path", "nearest", "margins", "capsules", "axes"):
        page.locator(f"[data-show={name}]").click()
    page.locator("#show > summary").click()
    assert page.evaluate(PIXELS)[1] == before


def test_the_nearest_points_are_those_of_the_certificate(page: Page) -> None:
    clearance = state(page, "answered.solution.certificate.clearance")
    drawn = page.evaluate(
        """() => {
            const { geometry } = studio.view.parts.nearest.children.at(-1);
            return [...geometry.attributes.position.array];
        }"""
    )
    assert np.array(drawn).reshape(2, 3) == pytest.approx(np.array(clearance["points"]), abs=DRAWN)
    expect(page.locator(".label.near")).to_contain_text(" – ".join(clearance["pair"]))


def test_the_makers_meshes_are_drawn(browser: Browser, service: Server, page: Page) -> None:
    """Without the meshes in the service, the arm is drawn from its figures, without a message."""
    with_meshes = page.evaluate(PIXELS)
    with opened(browser, f"{service.url}/studio") as other:
        other.route(
            "**/meshes.glb", lambda route: route.fulfill(status=404, json={"title": "No meshes"})
        )
        other.reload()
        until(other, SHOWN)
        until(
            other,
            "() => performance.getEntriesByType('resource').some(({ name }) => "
            "name.endsWith('/meshes.glb'))",
        )
        without = other.evaluate(PIXELS)
        assert not other.evaluate(MESHES) and other.locator("#problem").is_hidden()
        assert (
            without[0] == pytest.approx(with_meshes[0], rel=0.05) and without[1] != with_meshes[1]
        )
        other.unroute("**/meshes.glb")
        ask(other, move(robot="ur3e"))
        until(other, MESHES)


def test_what_stands_before_the_arm_fades(page: Page) -> None:
    """Only the side of the shelf in front of the arm fades, and only if fading is on."""
    faint = """show => {
        const { view } = studio;
        const { position } = view.camera;
        const before = position.clone();
        view.eye.fade = Object.getPrototypeOf(view.eye).fade;
        const own = view.eye.fade.bind(view.eye);
        view.eye.fade = (frames, ignored, _, moving) => own(frames, ignored, show, moving);
        position.set(-2.4, -0.6, 0.45);
        view.render();
        const faint = view.parts.obstacles.children
            .filter(({ userData }) => userData.material.opacity < 0.5);
        position.copy(before);
        delete view.eye.fade;
        view.render();
        return faint.map(({ userData }) => userData.name);
    }"""
    page.locator("#view").press("End")
    assert page.evaluate(faint, True) == ["shelf side"]
    assert page.evaluate(faint, False) == []


def test_a_coarse_picture_has_no_shadows(page: Page) -> None:
    """Without a graphics card, shadows take half the time of a moving picture; a still one has
    them.
    """
    drawn = """fineness => {
        const { view } = studio;
        view.setFineness(fineness);
        view.renderer.shadowMap.needsUpdate = true;
        view.renderer.render(view.scene, view.camera);
        return view.renderer.info.render.calls;
    }"""
    assert page.evaluate(drawn, 0.5) < page.evaluate(drawn, 1)


def test_an_obstacle_under_the_pointer_tells_its_name_and_margin(page: Page) -> None:
    shells = "() => studio.view.parts.margins.children.filter(({ visible }) => visible).length"
    x, y = page.evaluate("""() => {
        const { view } = studio;
        const top = view.parts.obstacles.children
            .find(({ userData }) => userData.name === "shelf top");
        const at = top.children[0].getWorldPosition(view.camera.position.clone());
        at.project(view.camera);
        const box = view.renderer.domElement.getBoundingClientRect();
        return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
    }""")
    assert page.evaluate(shells) == 0

    # A scene drawn anew in the meantime has its shell again at the next move of the pointer.
    def shown(k: int) -> bool:
        page.mouse.move(x + k % 2, y)
        return bool(page.evaluate(shells) == 1)

    assert any(map(shown, range(10)))
    expect(page.locator(".label.hover")).to_have_text("shelf top, margin 10.0 mm")
    page.mouse.move(5, 5)
    expect(page.locator(".label.hover")).to_have_count(0)
    assert page.evaluate(shells) == 0
