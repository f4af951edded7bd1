"""Meshes from files in memory, by trimesh, which follows no reference to another file."""

from __future__ import annotations

import struct
from io import BytesIO

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, UnreadableFile, unwatched
from joulepath.models.uploads.mesh_text import MeshSize, plain_obj, plain_stl

_STL_HEAD, _STL_TRIANGLE = 84, 50  # bytes


def read_mesh(
    kind: str, content: bytes, most: MeshSize, checkpoint: Checkpoint = unwatched
) -> tuple[Array, npt.NDArray[np.int64]]:
    """Corners (n, 3) in the units of a file, and triangles (m, 3) by their numbers; all bodies of
    it as one.

    `kind` is `stl`, `obj` or `glb`; of a GLB, the caller checks what it asks for. Raises
    UnreadableFile.
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
        raise UnreadableFile(
            f"is no {kind} file that can be read: export the mesh again."
        ) from error
    most.check(len(corners), len(triangles))
    return corners, triangles


def _is_binary_stl(content: bytes, most: MeshSize) -> bool:
    """Whether the length is that of as many triangles as the head says. Raises UnreadableFile for
    too many, or where it is less and the file is no text."""
    count = (
        struct.unpack("<I", content[_STL_HEAD - 4 : _STL_HEAD])[0]
        if len(content) >= _STL_HEAD
        else 0
    )
    length = _STL_HEAD + _STL_TRIANGLE * count
    if len(content) == length:
        most.check(3 * count, count)
    elif len(content) < length and b"solid" not in content[:1024].lower():
        raise UnreadableFile("is no complete STL file: it is shorter than its header says.")
    return len(content) == length
