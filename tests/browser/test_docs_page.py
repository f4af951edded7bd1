"""The documentation page in a browser: its Authorize button adds the key to its requests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, ViewportSize, expect

from tests.app.access.test_key_file import add
from tests.app.live import ANSWER, Server, serving
from tests.browsers import BROWSER, MISSING, chromium

PATIENCE = 1000 * ANSWER  # [ms]

SCREEN: ViewportSize = {"width": 1280, "height": 900}

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

POST = """([url, mode, key]) => fetch(url + "/studies", {
    method: "POST", mode, body: '{"name": "x", "threshold": 1}',
    headers: key ? {Authorization: "Bearer " + key} : {},
}).then(answer => answer.type, error => "refused")"""


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, str]]:
    """A service with keys, and a key."""
    file: Path = tmp_path_factory.mktemp("keys") / "keys.yaml"
    secret = add(file, "press")
    with serving(recorded=True, api_keys_file=file) as server:
        yield server, secret


@pytest.fixture
def page() -> Iterator[Page]:
    with chromium() as browser:
        page = browser.new_page()
        page.set_default_timeout(PATIENCE)
        yield page


def test_authorize(guarded: tuple[Server, str], page: Page) -> None:
    server, secret = guarded
    sent: list[str] = []
    blocked: list[str] = []
    page.on("request", lambda request: sent.append(request.url))
    page.on(
        "console",
        lambda message: (
            blocked.append(message.text) if "Content Security" in message.text else None
        ),
    )
    page.goto(f"{server.url}/docs")

    operation = page.locator("#operations-studies-list_studies_studies_get")
    status = operation.locator(".live-responses-table .response-col_status").last
    operation.locator(".opblock-summary-control").click()
    operation.locator(".try-out__btn").click()
    operation.locator(".execute").click()
    expect(status).to_contain_text("401", timeout=PATIENCE)

    page.locator(".auth-wrapper > .authorize").click()
    page.locator(".auth-container input").fill(secret)
    page.locator(".auth-btn-wrapper .authorize").click()
    page.locator(".auth-btn-wrapper .btn-done").click()
    operation.locator(".execute").click()
    expect(status).to_contain_text("200", timeout=PATIENCE)

    assert all(url.startswith((server.url, "data:")) for url in sent), (
        "nothing comes from elsewhere"
    )
    assert not blocked


def test_an_operation_fits_a_screen_and_is_tried_out(
    guarded: tuple[Server, str], page: Page
) -> None:
    """Every operation with closed parts fits a screen; the page asks this service alone."""
    server, secret = guarded
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.set_viewport_size(SCREEN)
    page.goto(f"{server.url}/docs")
    operations = page.locator(".opblock")
    expect(operations.last).to_be_visible()
    heights = dict[str, float]()
    for operation in operations.all():
        operation.locator(".opblock-summary-control").click()
        expect(operation.locator(".response").last).to_be_visible()
        box = operation.bounding_box()
        assert box is not None
        heights[operation.get_attribute("id") or ""] = box["height"]
        operation.locator(".opblock-summary-control").click()
    assert {name: own for name, own in heights.items() if own > SCREEN["height"]} == {}
    assert len(heights) > 50

    page.locator(".auth-wrapper > .authorize").click()
    page.locator(".auth-container input").fill(secret)
    page.locator(".auth-btn-wrapper .authorize").click()
    page.locator(".auth-btn-wrapper .btn-done").click()
    operation = page.locator("#operations-studies-create_studies_post")
    operation.locator(".opblock-summary-control").click()
    body = operation.locator(".opblock-section-request-body")
    body.get_by_role("tab", name="Schema").click()
    expect(body.locator("table td code").first).to_have_text("name")
    body.get_by_role("tab", name="Example").click()
    operation.locator(".try-out__btn").click()
    operation.locator(".execute").click()
    status = operation.locator(".live-responses-table .response-col_status").last
    expect(status).to_contain_text("201", timeout=PATIENCE)
    assert faults == []


def test_a_page_of_another_site_reaches_nothing(guarded: tuple[Server, str], page: Page) -> None:
    """From a page of another port, neither a form nor a script reaches the service, even with the
    key.
    """
    server, secret = guarded
    before = len(server.logged())
    with serving(recorded=True) as other:
        page.goto(f"{other.url}/healthz")
        assert page.evaluate(POST, [server.url, "no-cors", ""]) == "opaque"
        assert page.evaluate(POST, [server.url, "cors", secret]) == "refused"
        page.set_content(
            f"<form method=post enctype=text/plain action={server.url}/studies>"
            """<input name='{"name": "x", "threshold": 1, "a' value='": 1}'>"""
            "<button>go</button></form>"
        )
        with page.expect_response(f"{server.url}/studies") as answer:
            page.locator("button").click()
        assert answer.value.status == 403
    requests = [entry for entry in server.logged()[before:] if entry["message"] == "request"]
    refusals = [entry["problem"] for entry in requests if entry["method"] != "GET"]
    assert refusals == ["cross-site"] * 3
