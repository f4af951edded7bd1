"""Triangles of mesh files in requests.

Files are untrusted: their size is limited before decoding, and their content is counted before
meshes are built. Compressed parts of these formats are not unpacked.
"""

from __future__ import annotations

import hashlib
import struct
import threading
from typing import Literal

import numpy as np
from cachetools import LRUCache, cached

from joulepath.app.convert.fields import decoded
from joulepath.models.shape_sizes import SIZES
from joulepath.models.uploads.glb import check_glb
from joulepath.models.uploads.limits import UnreadableFile
from joulepath.models.uploads.mesh import read_mesh
from joulepath.models.uploads.mesh_text import MeshSize
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.clouds import CLOUD_RANGES, TriangleMesh

# triangles of cached meshes, 72 bytes each
MOST_KEPT_TRIANGLES = 400_000
_MOST = MeshSize(triangles=CLOUD_RANGES.max_triangles)

Format = Literal["stl", "obj", "glb"]


def mesh_from_file(file_format: Format, data: str, scale: float) -> TriangleMesh:
    """The mesh of a base64 file with a unit of length of `scale` [m].

    Raises InvalidProblem at the field `data`, and DeadlinePassed after a watched deadline.
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
    corners = corners * scale
    if (farthest := np.abs(corners).max()) > SIZES.largest:
        raise InvalidProblem(
            "scale",
            f"scale {scale:g} m makes the mesh reach {farthest:.4g} m from its origin, and at most "
            f"{SIZES.largest:g} m are possible: give 0.001 for a file in millimetres.",
        )
    return TriangleMesh(corners[triangles])
