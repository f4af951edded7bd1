"""GET /robots/{name}/meshes.glb; `tests/models/test_form.py` tests the places of the meshes."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import pytest
import trimesh
from starlette.testclient import TestClient

from joulepath.app.api.robots.pictures import PictureTask, kept
from joulepath.app.exceptions.stored import NoMeshes
from joulepath.optimizer.exceptions import UnknownRobot
from tests.app.live import ANSWER, ROOT
from tests.app.routes.test_problems import refused

MAKE = """
import hashlib
from joulepath.app.api.robots.pictures import PictureTask, _path
content = PictureTask("ur5e", "test").run(60).document
print(_path("ur5e").stat().st_ino, hashlib.sha256(content).hexdigest())
"""


def test_the_meshes_are_sent_once(client: TestClient) -> None:
    assert client.get("/robots/ur5e").json()["has_meshes"]
    answer = client.get("/robots/ur5e/meshes.glb")
    assert answer.status_code == 200 and answer.headers["content-type"] == "model/gltf-binary"
    assert answer.headers["content-encoding"] in ("gzip", "zstd")
    assert len(trimesh.load_scene(BytesIO(answer.content), file_type="glb").geometry) == 7
    again = client.get("/robots/ur5e/meshes.glb", headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304 and not again.content
    other = client.get("/robots/ur3e/meshes.glb", headers={"If-None-Match": answer.headers["etag"]})
    assert other.status_code == 200 and other.content != answer.content


@pytest.mark.parametrize("name", ["panda", "ur10e"])
def test_a_robot_without_meshes(client: TestClient, name: str) -> None:
    assert not client.get(f"/robots/{name}").json()["has_meshes"]
    refused(client.get(f"/robots/{name}/meshes.glb"), NoMeshes)


@pytest.mark.parametrize("name", ["none", "%2e%2e", "x" * 5000])
def test_an_unknown_robot(client: TestClient, name: str) -> None:
    refused(client.get(f"/robots/{name}/meshes.glb"), UnknownRobot)


@pytest.mark.long
def test_two_processes_make_one_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A file written twice would show another inode to one of the processes."""
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "cache"))
    both = [
        subprocess.Popen([sys.executable, "-c", MAKE], cwd=ROOT, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    told = {process.communicate(timeout=ANSWER)[0] for process in both}
    assert len(told) == 1
    content = kept("ur5e")
    assert content is not None and hashlib.sha256(content).hexdigest().encode() in told.pop()
    assert sorted(path.suffix for path in (tmp_path / "cache").iterdir()) == [".glb", ".lock"]


def test_a_cache_that_cannot_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "file" / "cache"))
    assert PictureTask("ur3e", "test").run(60).document.startswith(b"glTF")
    assert kept("ur3e") is None
