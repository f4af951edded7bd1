"""Meshes as read by this library, against trimesh's own reading of the same files."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from joulepath.models.meshes import mesh_file
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import UnreadableFile
from joulepath.models.uploads.mesh import read_mesh
from joulepath.models.uploads.mesh_text import MeshSize
from tests.mesh_folders import meshes as arm_folder

SQUARE = """#
o a
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 1
g b
usemtl c
f 1//1 2//1 3//1 \\
4//1
""".replace("\n", "\r\n")
BALL = trimesh.creation.icosphere(subdivisions=1)


def sorted_triangles(triangles: Array) -> list[list[tuple[float, ...]]]:
    """Triangles (n, 3, 3) in an order independent of the file and of their first corners."""
    found = []
    for corners in triangles.tolist():
        first = corners.index(min(corners))
        found.append([tuple(each) for each in corners[first:] + corners[:first]])
    return sorted(found)


def text_stl() -> bytes:
    """Two solids, in the spelling of several programs."""
    one = BALL.export(file_type="stl_ascii")
    return (one.replace("solid ", "solid first") + one.upper().replace("E+", "e+")).encode()


@pytest.mark.parametrize(
    ("kind", "content"),
    [
        ("obj", lambda: mesh_file(arm_folder("ur5e"), "visual", 4).read_bytes()),
        ("obj", lambda: mesh_file(arm_folder("ur5e"), "collision", 2).read_bytes()),
        ("obj", lambda: SQUARE.encode()),
        ("stl", lambda: BALL.export(file_type="stl")),
        ("stl", text_stl),
        ("glb", lambda: trimesh.Scene([BALL, trimesh.creation.box()]).export(file_type="glb")),
    ],
)
def test_the_same_triangles(kind: str, content: Callable[[], bytes]) -> None:
    data = content()
    corners, triangles = read_mesh(kind, data, MeshSize())
    alone = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False)
    assert sorted_triangles(corners[triangles]) == sorted_triangles(np.asarray(alone.triangles))
    assert len(triangles) > 1


@pytest.mark.parametrize("kind", ["stl", "obj"])
def test_what_is_too_large_is_refused_before_it_is_made(kind: str) -> None:
    content = BALL.export(file_type=kind)
    content = content if isinstance(content, bytes) else content.encode()
    with pytest.raises(UnreadableFile, match="more than 79 triangles"):
        read_mesh(kind, content, MeshSize(triangles=79))
    with pytest.raises(UnreadableFile, match="more than 20 corners"):
        read_mesh(kind, content, MeshSize(corners=20))


def test_a_face_may_name_textures_and_normals_of_some_corners_alone() -> None:
    """trimesh itself takes the numbers of textures and normals for numbers of corners."""
    mixed = SQUARE.replace("f 1//1 2//1 3//1 ", "f 1/1/1 2 3//1 ").replace("4//1", "4").encode()
    plain, triangles = read_mesh("obj", mixed, MeshSize())
    corners, same = read_mesh("obj", SQUARE.encode(), MeshSize())
    assert sorted_triangles(plain[triangles]) == sorted_triangles(corners[same])
