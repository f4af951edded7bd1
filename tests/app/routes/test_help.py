"""The pages of `docs/` as the service sends them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from joulepath.app.access.client import needed_role
from joulepath.app.api import pages
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.transport import NotFound, PagesNotBuilt
from joulepath.app.http.problems import path_of
from joulepath.app.main import create_app
from tests.app.live import LOCAL
from tests.app.routes.test_problems import refused


@pytest.fixture(scope="module")
def idle() -> TestClient:
    """The service without its workers, which no page needs."""
    return TestClient(create_app(), base_url=LOCAL)


def test_the_first_page_is_found_behind_any_path(idle: TestClient) -> None:
    answer = idle.get("/help", follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (307, "help/")
    assert "joulepath" in idle.get("/help/").text


def test_the_pages_allow_their_own_files_only(idle: TestClient) -> None:
    answer = idle.get("/help/how_to/")
    policy = answer.headers["content-security-policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'" and rules["connect-src"] == "'self'"
    for kind in ("script", "style"):
        assert re.fullmatch(r"'self'( 'sha256-[\w+/]{43}=')+", rules[f"{kind}-src"])
    assert "unsafe" not in policy and "http" not in policy


@pytest.mark.parametrize(
    ("path", "media_type"),
    [
        ("how_to/pendant_pose/", "text/html"),
        ("search.json", "application/json"),
        ("images/studio.png", "image/png"),
        ("files/examples/first_saving.py.text", "text/plain"),
        ("files/deploy/nginx/joulepath.conf", "text/plain"),
    ],
)
def test_pages_and_files_are_served(idle: TestClient, path: str, media_type: str) -> None:
    answer = idle.get(f"/help/{path}")
    assert answer.status_code == 200 and answer.headers["content-type"].startswith(media_type)
    again = idle.get(f"/help/{path}", headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304


@pytest.mark.parametrize("path", ["how_to", "how_to/pendant_pose", "reference/errors"])
def test_a_page_without_its_slash_leads_to_the_page(idle: TestClient, path: str) -> None:
    """Also behind a proxy's path: the target is relative."""
    answer = idle.get(f"/help/{path}", params={"q": "a"}, follow_redirects=False)
    assert answer.status_code == 307 and answer.headers["location"] == f"{path.split('/')[-1]}/?q=a"
    assert idle.get(f"/help/{path}").url.path == f"/help/{path}/"


@pytest.mark.parametrize(
    "path",
    [
        "nothing/",
        "nothing",
        "sources.txt",
        "style.digest",
        "%2e%2e/studio/main.js",
        "how_to/%2e%2e/how_to",
        "/how_to",
        "how_to%00",
        "//example.org/how_to",
    ],
)
def test_nothing_else_is_served(idle: TestClient, path: str) -> None:
    refused(idle.get(f"/help/{path}"), NotFound)


def test_pages_that_were_not_built_are_said_to_be_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(pages, "files", lambda _: tmp_path)
    pages._files.cache_clear()
    try:
        client = TestClient(create_app(), base_url=LOCAL)
        for path in ("/help/", "/help/how_to/", "/studio"):
            refused(client.get(path), PagesNotBuilt)
    finally:
        pages._files.cache_clear()


@pytest.mark.parametrize("path", ["/help", "/help/", "/help/start/first_saving/", "/help/a.js"])
def test_the_pages_need_no_key(path: str) -> None:
    assert needed_role("GET", path) is None
    assert needed_role("POST", path) is not None


def test_every_problem_page_leads_to_its_section(idle: TestClient) -> None:
    errors = idle.get("/help/reference/errors/").text
    for kind in types_of_error():
        page = idle.get(path_of(kind)).text
        assert f'href="../help/reference/errors/#{kind.slug()}"' in page
        assert f'id="{kind.slug()}"' in errors
