"""The studio page in a real browser: what its picture shows, and at what cost."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.live import Server
from tests.browser.pages import MESHES, SHOWN, opened, until
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)


@pytest.mark.long
def test_what_stands_before_the_arm_fades(page: Page) -> None:
    """The side of the shelf, seen through it; what stands behind the arm, or is not to fade, does not."""
    faint = """show => {
        const { view } = studio;
        const { position } = view.camera;
        const before = position.clone();
        studio.state.show.fade = show;
        position.set(-2.4, -0.6, 0.45);
        view.render();
        const faint = view.parts.obstacles.children.filter(({ userData }) => userData.material.opacity < 0.5);
        position.copy(before);
        studio.state.show.fade = true;
        view.render();
        return faint.map(({ userData }) => userData.name);
    }"""
    page.locator("#view").press("End")
    assert page.evaluate(faint, True) == ["shelf side"]
    assert page.evaluate(faint, False) == []


def test_a_coarse_picture_has_no_shadows(page: Page) -> None:
    """On a machine without a graphics card they take half the time of a moving picture. A still one has them again."""
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
        const top = view.parts.obstacles.children.find(({ userData }) => userData.name === "shelf top");
        const at = top.children[0].getWorldPosition(view.camera.position.clone()).project(view.camera);
        const box = view.renderer.domElement.getBoundingClientRect();
        return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
    }""")
    assert page.evaluate(shells) == 0
    page.mouse.move(x, y)
    expect(page.locator(".label.hover")).to_have_text("shelf top, margin 10.0 mm")
    assert page.evaluate(shells) == 1
    page.mouse.move(5, 5)
    expect(page.locator(".label.hover")).to_have_count(0)
    assert page.evaluate(shells) == 0


def test_words_stay_in_the_picture(browser: Browser, service: Server) -> None:
    """On a phone, the name of the nearest pair is wider than the room beside it."""
    with opened(browser, f"{service.url}/studio", viewport={"width": 390, "height": 844}) as page:
        until(page, SHOWN)
        until(page, MESHES)
        # once more drawn, after the picture was made anew
        page.evaluate("() => studio.view.render()")
        label, box = (page.locator(name).bounding_box() for name in (".label.near", "#labels"))
        assert label and box
        assert box["x"] <= label["x"] and label["x"] + label["width"] <= box["x"] + box["width"]
