"""The served files of the studio page and of the help pages; `tests/browser` tests their
contents.
"""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from starlette.testclient import TestClient

from joulepath.app.access.client import needed_role
from joulepath.app.api import pages
from joulepath.app.api.cycle.request import LONG_CYCLE, CycleRequest
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.transport import NotFound, PagesNotBuilt
from joulepath.app.http.problems import own_fields, path_of
from joulepath.app.main import create_app
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.exceptions import UnknownRobot
from tests.app.live import LOCAL, ROOT
from tests.app.routes.test_problems import refused

SOURCES = ROOT / "app" / "studio"
PAGE = ROOT / "app" / "static" / "studio"
FIRST_LOAD = 1_200_000  # byte, compressed; without the answer and the meshes
OURS = sorted(path for kind in ("ts*", "css") for path in (SOURCES / "src").rglob(f"*.{kind}"))


def test_the_root_leads_there_behind_any_path(client: TestClient) -> None:
    answer = client.get("/", follow_redirects=False)
    assert answer.status_code == 307 and answer.headers["location"] == "studio"


def test_the_deadlines_that_the_page_tells_are_those_of_the_service() -> None:
    text = (SOURCES / "src" / "store" / "request.ts").read_text("utf-8")
    fields = (OptimizeRequest.model_fields, CycleRequest.model_fields)
    move, cycle = (int(each["deadline"].default) for each in fields)
    told = f"{{ optimize: {move}, cycle: {cycle}, long: {int(LONG_CYCLE.deadline)} }}"
    assert told in text and f"const LONG = {LONG_CYCLE.stops};" in text


def test_the_page_allows_its_own_files_only(client: TestClient) -> None:
    policy = client.get("/studio").headers["content-security-policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    for kind in ("connect", "font", "script", "style"):
        assert rules[f"{kind}-src"] == "'self'"
    assert "unsafe" not in policy and "http" not in policy


def test_a_file_is_sent_once(client: TestClient) -> None:
    """The weak tag of a compressed answer avoids a second transfer, too."""
    for coding in ("identity", "gzip", "zstd"):
        headers = {"Accept-Encoding": coding}
        first = client.get("/studio/main.js", headers=headers)
        assert first.status_code == 200 and first.headers["content-type"].startswith(
            "text/javascript"
        )
        again = client.get(
            "/studio/main.js", headers=headers | {"If-None-Match": f'"x", {first.headers["etag"]}'}
        )
        assert again.status_code == 304 and not again.content
        assert (
            client.get("/studio/main.js", headers=headers | {"If-None-Match": '"x"'}).status_code
            == 200
        )


@pytest.mark.parametrize(
    "path", ["nothing.js", "licences.txt", "../main.js", "%2e%2e/__init__.py", "x" * 5000]
)
def test_nothing_else_is_served(client: TestClient, path: str) -> None:
    refused(client.get(f"/studio/{path}"), NotFound)


def test_the_first_load_is_small(client: TestClient) -> None:
    """The page stays below the limit together with everything that it may load."""
    names = [path.name for path in PAGE.iterdir() if path.suffix not in (".html", ".txt")]
    answers = {path: client.get(path) for path in ("studio", *(f"studio/{n}" for n in names))}
    assert {answer.status_code for answer in answers.values()} == {200}
    named = re.findall(r'(?:href|src)="(studio/[^"]+)"', answers["studio"].text)
    assert len(named) == 2 and set(named) <= set(answers)
    sizes = {path: len(gzip.compress(answer.content)) for path, answer in answers.items()}
    assert sum(sizes.values()) < FIRST_LOAD, sizes


def test_the_libraries_are_those_that_are_pinned() -> None:
    """Versions are pinned by digests, without addresses: npm uses its configured registry.

    The licences of all libraries in the bundle are beside it.
    """
    lock = json.loads((SOURCES / "package-lock.json").read_text())
    pins = json.loads((SOURCES / "package.json").read_text())
    packages = {
        name.removeprefix("node_modules/"): each for name, each in lock["packages"].items() if name
    }
    for name, version in (pins["dependencies"] | pins["devDependencies"]).items():
        assert packages[name]["version"] == version
    assert all(
        each["integrity"].startswith("sha512-") and "resolved" not in each
        for each in packages.values()
    )
    licences = (PAGE / "licences.txt").read_text()
    assert all(f"{name}\n" in licences for name in pins["dependencies"])


def test_no_address_of_elsewhere() -> None:
    allowed = "http://www.w3.org/2000/svg"
    assert [path.name for path in OURS if "://" in path.read_text().replace(allowed, "")] == []


def test_the_urdf_of_a_robot(client: TestClient) -> None:
    answer = client.get("/robots/ur5e/urdf")
    assert answer.headers["content-type"] == "application/xml"
    robot = ElementTree.fromstring(answer.text)
    links = [link.get("name") for link in robot.findall("link")]
    assert (
        links[0] == "base"
        and links[-1] == "flange"
        and len(robot.findall("joint[@type='revolute']")) == 6
    )
    refused(client.get("/robots/none/urdf"), UnknownRobot)


def test_a_slash_behind_the_address_leads_to_the_page(client: TestClient) -> None:
    answer = client.get("/studio/", follow_redirects=False)
    # relative: it holds behind a proxy's path, too
    assert (answer.status_code, answer.headers["location"]) == (307, "../studio")
    assert "leave out a slash" in client.post("/optimize/", json={}).json()["detail"]


@pytest.fixture(scope="module")
def idle() -> TestClient:
    """The service without its workers: pages need none."""
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
    """The target of the redirection is relative, so it holds behind a proxy's path, too."""
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
def test_nothing_beside_the_pages_is_served(idle: TestClient, path: str) -> None:
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


def test_every_problem_has_a_page_that_leads_to_its_section(idle: TestClient) -> None:
    errors = idle.get("/help/reference/errors/").text
    for kind in types_of_error():
        answer = idle.get(path_of(kind))
        assert answer.headers["content-type"].startswith("text/html"), kind
        page = answer.text
        fields = [f"<code>{field}</code>" for field in own_fields(kind)]
        assert all(part in page for part in (kind.title, *fields)), kind
        assert "://" not in page
        assert f'href="../help/reference/errors/#{kind.slug()}"' in page
        assert f'id="{kind.slug()}"' in errors
