"""One service and one browser for all tests of the page that run one after the other.

The browser's event loop must end with them: other tests start one of their own.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from tests.app.live import GRACE, Server, serving
from tests.browser.pages import MESHES, SHOWN, opened, until
from tests.browsers import SOFTWARE, chromium


@pytest.fixture(scope="package")
def service() -> Iterator[Server]:
    """With a database of its own."""
    with serving(workers=1, deadline_grace=GRACE) as server:
        yield server


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    with chromium(*SOFTWARE) as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser: Browser, service: Server) -> Iterator[Page]:
    """The page with its first example, still. Tests of a module share it."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        until(page, MESHES)
        yield page
