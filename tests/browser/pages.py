"""The studio page in a browser, with checks of every test: no console error, no foreign request."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page, expect

from tests.app.live import ANSWER, ROOT

FIRST = json.loads((ROOT / "examples" / "optimize" / "bin_to_shelf.json").read_text())
"""The request of the first visit."""
PATIENCE = 1000 * ANSWER  # [ms]
expect.set_options(timeout=PATIENCE)
SHOWN = (
    "() => Boolean(window.studio?.state.answered && !studio.state.run && "
    "(window.studio.view?.frames ?? 1))"
)
# Parts drawn from figures have texture coordinates, meshes have none.
MESHES = (
    "() => Boolean(window.studio?.view?.arms.length) && "
    "!studio.view.arms[0].drawn[0].geometry.hasAttribute('uv')"
)
ROUNDING = 1e-9  # m; sums of some ten products in double precision
PIXELS = """() => {
    const { view } = studio;
    view.setFineness(0.5);
    view.renderer.render(view.scene, view.camera);
    const gl = view.renderer.getContext();
    const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const data = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
    let drawn = 0, sum = 0;
    for (let k = 0; k < data.length; k += 4) {
        drawn += data[k + 3] > 0;
        sum += data[k] + 3 * data[k + 1] + 7 * data[k + 2];
    }
    return [drawn / (width * height), sum];
}"""
AXE = (ROOT / "app" / "studio" / "node_modules" / "axe-core" / "axe.min.js").read_text("utf-8")


def until(page: Page, condition: str, patience: float = ANSWER) -> None:
    """Waits until a JavaScript function of the page returns true.

    The policy of the page forbids `wait_for_function`.
    """
    end = time.monotonic() + patience
    while not page.evaluate(condition):
        told = page.evaluate("() => window.studio?.state.trouble")
        assert time.monotonic() < end, (condition, told)
        page.wait_for_timeout(20)


def state(page: Page, what: str) -> Any:
    return page.evaluate(f"() => studio.state.{what}")


def tcp(page: Page, time: float) -> np.ndarray:
    """The pose of the drawn TCP (4, 4) at a time."""
    page.locator("#scrub").evaluate(
        "(it, time) => { it.value = time; it.dispatchEvent(new Event('input')); }", time
    )
    return np.array(page.evaluate("() => studio.tcp()")).reshape(4, 4)


def show_json(page: Page, shown: bool = True) -> None:
    """Shows the request as JSON, or as the task panel."""
    if (page.locator("#json-toggle").get_attribute("aria-pressed") == "true") != shown:
        page.locator("#json-toggle").click()


def fill_json(page: Page, body: dict[str, Any] | str) -> None:
    """Puts a request, or any text, into the JSON editor."""
    show_json(page)
    page.locator("#json").fill(body if isinstance(body, str) else json.dumps(body))
    page.locator("#json").blur()


def ask(page: Page, body: dict[str, Any]) -> None:
    """Sends a body from the page, and waits for the answer."""
    before = state(page, "answered?.solution.id")
    fill_json(page, body)
    page.locator("#optimise").click()
    until(
        page,
        f"() => !studio.state.run && studio.state.answered?.solution.id !== '{before}'",
    )
    show_json(page, False)


def type_into(page: Page, pointer: str, text: str) -> None:
    """Types a number into the cell of a field of the request."""
    cell = page.locator(f"[data-pointer='{pointer}']")
    cell.fill(text)
    cell.press("Enter")


def new_cell(page: Page) -> None:
    until(page, SHOWN)
    page.locator("#project > summary").click()
    page.get_by_role("button", name="New cell").click()


def optimised(page: Page) -> None:
    page.keyboard.press("Control+Enter")
    until(page, "() => !studio.state.run && studio.state.answered && !studio.state.stale")


def search_places(page: Page, half: int, seconds: int) -> None:
    """Searches for a place of the robot, up to `half` [mm] along x and y, at every 100 mm."""
    page.locator("#place-robot").click()
    region = page.locator("#region")
    for name in ("x", "y"):
        region.get_by_label(f"{name} from in mm").fill(f"-{half}")
        region.get_by_label(f"{name} to in mm").fill(f"{half}")
    region.get_by_label("Spacing of places").fill("100")
    region.get_by_label("Search time").fill(f"{seconds}")
    page.locator("#search-places").click()


def go(page: Page, name: str) -> None:
    """Opens a page of the studio by its name in the bar."""
    page.locator("nav.pages").get_by_role("button", name=name, exact=True).click()


def findings(page: Page) -> list[str]:
    """Serious findings of axe on the visible page."""
    page.evaluate(AXE)
    found = page.evaluate("() => axe.run(document, { resultTypes: ['violations'] })")
    return [
        f"{each['id']}: {[node['html'][:160] for node in each['nodes'][:3]]}"
        for each in found["violations"]
        if each["impact"] in ("serious", "critical")
    ]


@contextmanager
def opened(
    browser: Browser, url: str, tolerated: str = "status of (4|504)", **options: Any
) -> Iterator[Page]:
    """A page of a fresh context of 1280 x 800; errors and foreign requests fail the test.

    An error is tolerated if its text has the given pattern.
    """
    options = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce", **options}
    context = browser.new_context(accept_downloads=True, **options)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on(
        "console",
        lambda message: (
            faults.append(message.text) if message.type in ("error", "warning") else None
        ),
    )
    page.on("pageerror", lambda error: faults.append(str(error)))
    own = ("/".join(url.split("/")[:3]), "data:", "blob:")
    page.on(
        "request", lambda sent: faults.append(sent.url) if not sent.url.startswith(own) else None
    )
    page.goto(url)
    yield page
    context.close()
    # Chromium itself reports a refused request as failed, and these tests provoke refusals. On a
    # busy machine, a posture may pass the deadline of its motion.
    left = [fault for fault in faults if not re.search(tolerated, fault)]
    assert not left, left
