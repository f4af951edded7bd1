"""GET /robots/{name}/meshes.glb in a worker: simplifies the meshes once, and keeps the file in the
cache.
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import joulepath.models.meshes
import joulepath.models.pictures
from joulepath.app.engine.result import TaskResult
from joulepath.models.pictures import picture, picture_sources
from joulepath.optimizer.native.library_cache import cache_directory, work_folder

logger = logging.getLogger(__name__)

MEDIA_TYPE = "model/gltf-binary"


@cache
def digest(robot: str) -> str | None:
    """Hash of all sources of the picture of a robot; None if its meshes are not installed."""
    sources = picture_sources(robot)
    if sources is None:
        return None
    h = hashlib.sha256(
        repr([version(name) for name in ("trimesh", "fast-simplification")]).encode()
    )
    for path in (
        *(
            Path(str(module.__file__))
            for module in (joulepath.models.meshes, joulepath.models.pictures)
        ),
        *sources,
    ):
        h.update(path.read_bytes())
    return h.hexdigest()[:24]


def kept(robot: str) -> bytes | None:
    """The picture of a robot from the cache; None if it is not there."""
    try:
        return _path(robot).read_bytes()
    except OSError:
        return None


@dataclass(frozen=True)
class PictureTask:
    """The name of a robot with installed meshes, and the id of the request."""

    robot: str
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The GLB file, within about a second regardless of `deadline`.

        A lock prevents several processes from making the same file.
        """
        path = _path(self.robot)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.with_suffix(".lock").open("wb") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                content = kept(self.robot) or _written(path, picture(self.robot))
        except OSError as error:
            logger.warning("the meshes of %s are not kept: %s", self.robot, error)
            content = picture(self.robot)
        return TaskResult(content, MEDIA_TYPE)


def _written(path: Path, content: bytes) -> bytes:
    """Writes a file and renames it into place, so readers never see an incomplete file."""
    with work_folder(path) as folder:
        part = folder / path.name
        part.write_bytes(content)
        part.replace(path)
    return content


def _path(robot: str) -> Path:
    return cache_directory() / f"{robot}-{digest(robot)}.glb"
