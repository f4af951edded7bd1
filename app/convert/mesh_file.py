"""From mesh files in a request to triangles of the library.

A file is untrusted. Its size is limited before it is decoded, and what it holds is counted before a
mesh is made of it. Files in these formats hold no compressed parts that are unpacked here.
"""

from __future__ import annotations

import hashlib
import struct
import threading
from typing import Literal

from cachetools import LRUCache, cached

from joulepath.app.convert.base64_data import decoded
from joulepath.models.uploads.glb import check_glb
from joulepath.models.uploads.limits import UnreadableFile
from joulepath.models.uploads.mesh import read_mesh
from joulepath.models.uploads.mesh_text import MeshSize
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.clouds import MOST_TRIANGLES, TriangleMesh

# meshes that are kept for the next request with the same file, of so many triangles in all: 72
# bytes each
MOST_KEPT_TRIANGLES = 400_000
_MOST = MeshSize(triangles=MOST_TRIANGLES)

Format = Literal["stl", "obj", "glb"]


def mesh_from_file(file_format: Format, data: str, scale: float) -> TriangleMesh:
    """The mesh of a file in base64, whose unit of length is `scale` [m].

    Raises InvalidProblem at the field `data`, and DeadlinePassed once a watched deadline has
    passed.
    """
    return _mesh(file_format, decoded(data, "data"), scale)


def _digest(file_format: Format, content: bytes, scale: float) -> bytes:
    return hashlib.blake2b(content, person=file_format.encode()).digest() + struct.pack("<d", scale)


@cached(
    LRUCache(MOST_KEPT_TRIANGLES, getsizeof=lambda mesh: len(mesh.corners)),
    key=_digest,
    lock=threading.Lock(),
)
def _mesh(file_format: Format, content: bytes, scale: float) -> TriangleMesh:
    try:
        if file_format == "glb":
            check_glb(content, _MOST)
        corners, triangles = read_mesh(file_format, content, _MOST, checkpoint)
    except UnreadableFile as error:
        raise InvalidProblem("data", f"data {error}") from error
    if not len(triangles):
        raise InvalidProblem(
            "data", f"data has no triangles: give a {file_format} file of a mesh with faces."
        )
    return TriangleMesh(corners[triangles] * scale)
