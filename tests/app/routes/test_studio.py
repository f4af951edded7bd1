"""The files of the studio page as they are served. What they show is tested in a browser:
`tests/browser`.
"""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from starlette.testclient import TestClient

from joulepath.app.exceptions.transport import NotFound
from joulepath.optimizer.exceptions import UnknownRobot
from tests.app.live import ROOT
from tests.app.routes.test_problems import refused

PAGE = ROOT / "app" / "static" / "studio"
FIRST_LOAD = 1_000_000  # byte, compressed; without the answer
OURS = sorted(path for kind in ("js", "css", "html") for path in PAGE.glob(f"*.{kind}"))


def test_the_root_leads_there_behind_any_path(client: TestClient) -> None:
    answer = client.get("/", follow_redirects=False)
    assert answer.status_code == 307 and answer.headers["location"] == "studio"


def test_the_page_allows_its_own_files_only(client: TestClient) -> None:
    policy = client.get("/studio").headers["content-security-policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert (
        rules["default-src"] == "'none'" and rules["connect-src"] == rules["style-src"] == "'self'"
    )
    assert "unsafe" not in policy and "http" not in policy
    assert re.fullmatch(r"'self' 'sha256-[\w+/]+='", rules["script-src"])


def test_a_file_is_sent_once(client: TestClient) -> None:
    """The tag of a compressed answer is a weak one."""
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
    "path", ["nothing.js", "", "vendor", "../main.js", "%2e%2e/__init__.py", "x" * 5000]
)
def test_nothing_else_is_served(client: TestClient, path: str) -> None:
    refused(client.get(f"/studio/{path}"), NotFound)


def test_the_first_load_is_small(client: TestClient) -> None:
    """The page, and all that it loads for the first picture, the maker's meshes and their reader
    included.
    """
    reader = "studio/vendor/three/examples/jsm/loaders/GLTFLoader.js"
    waiting, seen = (
        ["studio", "studio/first.json", reader, "robots/ur5e/meshes.glb"],
        dict[str, int](),
    )
    names = {
        "three": "studio/vendor/three/build/three.module.js",
        "uplot": "studio/vendor/uplot/dist/uPlot.esm.js",
    }
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        answer = client.get(path)
        assert answer.status_code == 200, path
        seen[path] = len(gzip.compress(answer.content))
        if path == "studio":
            waiting += re.findall(r'(?:href|src)="(studio/[^"]+)"', answer.text)
        elif path.endswith(".js"):
            for name in re.findall(
                r'^\s*(?:import|export)\b[^;]*?from\s*["\']([^"\']+)["\']',
                answer.text,
                re.MULTILINE,
            ):
                folder = Path(path).parent
                of_three = f"studio/vendor/three/examples/jsm/{name.removeprefix('three/addons/')}"
                relative = (
                    str((ROOT / folder / name).resolve().relative_to(ROOT))
                    if name.startswith(".")
                    else of_three
                )
                waiting.append(names.get(name, relative))
    assert len(seen) > len(OURS)
    assert sum(seen.values()) < FIRST_LOAD, seen


def test_the_libraries_are_those_that_are_pinned() -> None:
    """With digests, and without an address: npm asks whatever registry it is set to."""
    lock = json.loads((PAGE / "package-lock.json").read_text())
    pinned = json.loads((PAGE / "package.json").read_text())["dependencies"]
    packages = {
        name.removeprefix("node_modules/"): each for name, each in lock["packages"].items() if name
    }
    assert {name: each["version"] for name, each in packages.items()} == pinned
    assert all(
        each["integrity"].startswith("sha512-") and "resolved" not in each
        for each in packages.values()
    )
    three = (PAGE / "vendor" / "three" / "build" / "three.core.js").read_text()
    assert f"const REVISION = '{pinned['three'].split('.')[1]}'" in three
    assert {path.parent.name for path in (PAGE / "vendor").rglob("LICENSE")} == set(pinned)


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_no_address_of_elsewhere(path: Path) -> None:
    addresses = re.findall(r"https?://[^\s\"'`)]+", path.read_text())
    assert set(addresses) <= {"http://www.w3.org/2000/svg"}


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
