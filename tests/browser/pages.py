"""The studio page in a browser, and what every test asks of it: no error in its console, no request
to elsewhere.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Browser, Page, expect

from tests.app.live import ANSWER, ROOT

FIRST = json.loads((ROOT / "examples" / "optimize" / "bin_to_shelf.json").read_text())
"""The request of the first visit."""
PATIENCE = 1000 * ANSWER  # [ms]
expect.set_options(timeout=PATIENCE)
SHOWN = "() => Boolean(window.studio?.state.answer && (window.studio.view?.frames ?? 1))"
# what is drawn from figures has texture coordinates, the meshes have none
MESHES = (
    "() => Boolean(window.studio?.view?.arms) && "
    "!studio.view.arms[0].drawn[0].geometry.hasAttribute('uv')"
)


def until(page: Page, condition: str, patience: float = ANSWER) -> None:
    """Waits until a JavaScript function of the page returns true. The page's own policy forbids
    `wait_for_function`.
    """
    end = time.monotonic() + patience
    while not page.evaluate(condition):
        told = (
            [page.locator(box).inner_text() for box in ("#problem", "#status")]
            if time.monotonic() > end
            else None
        )
        assert told is None, (condition, *told)
        page.wait_for_timeout(20)


def state(page: Page, what: str) -> Any:
    return page.evaluate(f"() => studio.state.{what}")


def show(page: Page, tab: str) -> None:
    page.locator(f"#tab-{tab}").click()


def ask(page: Page, body: dict[str, Any]) -> None:
    """Sends a body from the page, and waits for the answer."""
    before = state(page, "answer.id")
    show(page, "json")
    page.locator("#json").fill(json.dumps(body))
    page.locator("#json").blur()
    page.locator("#optimise").click()
    until(page, f"() => studio.state.answer.id !== '{before}'")


@contextmanager
def opened(browser: Browser, url: str, **options: Any) -> Iterator[Page]:
    """A page of a fresh context, at 1024 x 640, whose errors and foreign requests fail the test."""
    options = {"viewport": {"width": 1024, "height": 640}, "reduced_motion": "reduce", **options}
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
    own = (url.split("/studio")[0], "data:", "blob:")
    page.on(
        "request", lambda sent: faults.append(sent.url) if not sent.url.startswith(own) else None
    )
    page.goto(url)
    yield page
    context.close()
    # Chromium itself says of a refused request that it failed: that is what these tests provoke
    left = [fault for fault in faults if "status of 4" not in fault]
    assert not left, left
