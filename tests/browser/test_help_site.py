"""The pages at `/help` in a browser: no foreign request, nothing against their policy, a search."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from joulepath.app.http.problems import path_of
from joulepath.optimizer.exceptions import UnreachablePose
from tests.app.live import Server
from tests.browser.pages import findings, opened
from tests.browsers import BROWSER, MISSING

pytestmark = [pytest.mark.skipif(BROWSER is None, reason=MISSING), pytest.mark.long]
PAGES = ("", "start/first_saving/", "how_to/", "how_to/work_cycle/", "reference/errors/")


@pytest.fixture(scope="module")
def page(browser: Browser, service: Server) -> Iterator[Page]:
    """The first page; messages on its console and requests to other hosts fail the tests."""
    with opened(browser, f"{service.url}/help/") as page:
        yield page


@pytest.mark.parametrize("path", PAGES)
def test_a_page_is_shown_and_can_be_read_by_everybody(
    page: Page, service: Server, path: str
) -> None:
    page.goto(f"{service.url}/help/{path}")
    expect(page.locator("h1").first).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert findings(page) == []


def test_pages_without_a_theme_can_be_read_by_everybody(browser: Browser, service: Server) -> None:
    """Swagger UI itself puts links into buttons, and lets examples scroll that no key reaches."""
    for path in (path_of(UnreachablePose), "/docs"):
        with opened(browser, service.url + path) as page:
            expect(page.get_by_role("main").get_by_role("heading").first).to_be_visible()
            found = [name.partition(":")[0] for name in findings(page)]
            assert found == (["nested-interactive"] if path == "/docs" else [])
    with opened(browser, f"{service.url}/help/reference/cycle/", color_scheme="dark") as page:
        assert findings(page) == []


def test_the_search_finds_a_page_and_opens_it(page: Page, service: Server) -> None:
    page.goto(f"{service.url}/help/")
    page.get_by_role("button", name="Search").first.click()
    page.get_by_role("combobox", name="Search").fill("compare two grippers")
    page.get_by_role("listbox").get_by_text("Compare two grippers").first.click()
    page.wait_for_url("**/help/how_to/compare_grippers/**")


def test_a_problem_page_leads_to_its_section(page: Page, service: Server) -> None:
    page.goto(f"{service.url}{path_of(UnreachablePose)}")
    page.locator("a[href*='help/reference/errors/']").first.click()
    slug = UnreachablePose.slug()
    page.wait_for_url(f"**/help/reference/errors/#{slug}")
    expect(page.locator(f"[id='{slug}']")).to_be_in_viewport()


def test_the_pages_fit_a_phone_and_the_night(browser: Browser, service: Server) -> None:
    where = f"{service.url}/help/start/first_saving/"
    phone = {"width": 390, "height": 800}
    with opened(browser, where, viewport=phone, color_scheme="dark") as page:
        expect(page.locator("h1").first).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert sum(map(int, colour[4:-1].split(","))) < 150
        assert findings(page) == []


def test_operations_lead_to_their_pages(browser: Browser, service: Server) -> None:
    with opened(browser, f"{service.url}/docs") as page:
        operation = page.locator("#operations-motion-optimize_optimize_post")
        operation.locator(".opblock-summary-control").click()
        link = operation.locator("a[href*='/help/']")
        expect(link).to_be_visible()
        page.goto(link.get_attribute("href") or "")
        expect(page.locator("h1").first).to_be_visible()
