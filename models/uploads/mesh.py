"""Meshes from files in memory by trimesh, without following references to other files."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, UnreadableFile, unwatched
from joulepath.models.uploads.mesh_text import MeshSize, plain_obj, plain_stl


@dataclass(frozen=True)
class StlLayout:
    """Layout of a binary STL [byte]."""

    head: int = 84
    triangle: int = 50


_STL = StlLayout()


def read_mesh(
    kind: str, content: bytes, most: MeshSize, checkpoint: Checkpoint = unwatched
) -> tuple[Array, npt.NDArray[np.int64]]:
    """Corners (n, 3) in the units of a file and index triples (m, 3), all bodies joined.

    `kind` is `stl`, `obj` or `glb`; the caller checks a GLB by `check_glb`. Raises UnreadableFile.
    """
    if kind == "obj":
        content = plain_obj(content, most, checkpoint)
    elif kind == "stl" and not _is_binary_stl(content, most):
        content = plain_stl(content, most, checkpoint)
    import trimesh  # only requests with a mesh file need it

    checkpoint()
    try:
        mesh = trimesh.load_mesh(
            BytesIO(content), file_type=kind, resolver=None, process=False, skip_materials=True
        )
        corners = np.asarray(mesh.vertices, dtype=float).reshape(-1, 3)
        triangles = np.asarray(getattr(mesh, "faces", ()), dtype=np.int64).reshape(-1, 3)
    except Exception as error:  # trimesh raises many kinds for broken files
        raise UnreadableFile(f"is not a readable {kind} file: export the mesh again.") from error
    most.check(len(corners), len(triangles))
    return corners, triangles


def _is_binary_stl(content: bytes, most: MeshSize) -> bool:
    """Whether the length agrees with the number of triangles in the head.

    Raises UnreadableFile for too many triangles, or a truncated binary file.
    """
    count = (
        struct.unpack("<I", content[_STL.head - 4 : _STL.head])[0]
        if len(content) >= _STL.head
        else 0
    )
    length = _STL.head + _STL.triangle * count
    if len(content) == length:
        most.check(3 * count, count)
    elif len(content) < length and b"solid" not in content[:1024].lower():
        raise UnreadableFile("is an incomplete STL file: it is shorter than its header says.")
    return len(content) == length
