"""One service for all tests of the page in a process, and a browser for each of their files.

The browser's event loop must end with the file: tests of other files start one of their own.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from tests.app.live import GRACE, Server, serving
from tests.browser.pages import MESHES, SHOWN, opened, until
from tests.browsers import SOFTWARE, chromium


@pytest.fixture(scope="session")
def service() -> Iterator[Server]:
    """A service with a database of its own."""
    with serving(workers=1, deadline_grace=GRACE) as server:
        yield server


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium(*SOFTWARE) as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser: Browser, service: Server) -> Iterator[Page]:
    """The page at rest with its first example, shared by the tests of a module."""
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        until(page, MESHES)
        yield page
