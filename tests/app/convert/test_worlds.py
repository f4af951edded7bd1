"""Point clouds, voxels and mesh files of a request: their conversion and their refusals."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np
import pytest
import trimesh

from joulepath.app.convert import mesh_file
from joulepath.app.convert.mesh_file import MOST_KEPT_TRIANGLES, mesh_from_file
from joulepath.app.convert.scene import to_scene
from joulepath.app.schemas.examples.values import MESH_FILE
from joulepath.app.schemas.scene import Scene
from joulepath.app.schemas.shapes import MOST_CELLS
from joulepath.models.robot import Array
from joulepath.optimizer.problem.clouds import CLOUD_RANGES, Points, Voxels
from joulepath.optimizer.problem.robots import load_robot
from tests.refusals import refusal_of

# a file in single precision cycles coordinates of a metre to this [m]
SINGLE = 1e-7


def base64_of(content: bytes | str) -> str:
    return base64.b64encode(content.encode() if isinstance(content, str) else content).decode()


def shape_of(**fields: Any) -> Any:
    scene = Scene.model_validate_json(json.dumps({"obstacles": [{"name": "scan"} | fields]}))
    return to_scene(scene, load_robot("ur5e")).obstacles[0].shape


def bits_of(occupied: Any) -> str:
    """Base64 of an occupancy grid (nx, ny, nz) as the contract describes it."""
    return base64_of(
        np.packbits(np.asarray(occupied, dtype=bool).ravel(order="F"), bitorder="little").tobytes()
    )


def torus() -> Any:
    return trimesh.creation.torus(0.3, 0.05, major_sections=16, minor_sections=8)


def in_order(triangles: Array) -> Array:
    """Triangles (n, 9), each with its least corner first, sorted."""
    rows = []
    for triangle in np.round(np.asarray(triangles), 5).tolist():
        k = triangle.index(min(triangle))
        rows.append([x for corner in triangle[k:] + triangle[:k] for x in corner])
    return np.array(sorted(rows))


def test_points() -> None:
    shape = shape_of(shape="points", points=[[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], radius=0.02)
    assert isinstance(shape, Points) and shape.points.tolist() == [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    assert shape.radius == 0.02


def test_voxels_by_cells_and_by_bits_are_the_same() -> None:
    grid = np.random.default_rng(1).random((5, 3, 4)) < 0.3
    cells = shape_of(shape="voxels", size=0.05, cells=np.argwhere(grid).tolist())
    bits = shape_of(
        shape="voxels", size=0.05, bits={"dimensions": [5, 3, 4], "data": bits_of(grid)}
    )
    assert isinstance(cells, Voxels) and isinstance(bits, Voxels)
    assert cells.cells.tolist() == bits.cells.tolist() == np.argwhere(grid).tolist()


@pytest.mark.parametrize("format_", ["stl", "obj", "glb"])
def test_a_mesh_file_keeps_every_triangle(format_: Any) -> None:
    """The mesh keeps all triangles of the file, at the requested scale, and stays closed."""
    found = mesh_from_file(format_, base64_of(torus().export(file_type=format_)), 0.5)
    assert found.is_closed and found.corners.shape == (256, 3, 3)
    ours, theirs = in_order(found.corners * 2), in_order(torus().triangles)
    assert (
        np.abs(ours - theirs).max() < 2e-5
    )  # rounded to five digits, so that corners can be sorted


def test_text_stl_and_a_scene_of_several_bodies() -> None:
    found = mesh_from_file("stl", base64_of(torus().export(file_type="stl_ascii")), 1.0)
    assert np.abs(in_order(found.corners) - in_order(torus().triangles)).max() < 2e-5
    moved = torus().apply_translation([1.0, 0.0, 0.0])
    scene = trimesh.Scene([torus(), moved])
    both = mesh_from_file("glb", base64_of(scene.export(file_type="glb")), 1.0)
    assert len(both.corners) == 512 and both.corners[..., 0].max() == pytest.approx(
        1.35, abs=SINGLE
    )


def test_the_example_of_the_contract_is_a_tetrahedron() -> None:
    found = mesh_from_file("stl", MESH_FILE, 0.001)
    assert found.is_closed and sorted(np.unique(found.corners.reshape(-1, 3), axis=0).tolist()) == [
        [0, 0, 0],
        [0, 0, pytest.approx(0.1)],
        [0, pytest.approx(0.1), 0],
        [pytest.approx(0.1), 0, 0],
    ]


def glb(**fields: Any) -> bytes:
    """A GLB with these fields in its JSON part, without any data."""
    text = json.dumps(
        {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}]} | fields
    ).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


ACCESSOR = {"componentType": 5126, "count": 2**31, "type": "VEC3"}
BOMB = {
    "accessors": [ACCESSOR],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "nodes": [{"mesh": 0}],
}
REPEATED = {"nodes": [{"children": [1, 1]}, {"children": [2, 2]}, {"children": [3, 3]}, {}]}
ONE_BIT = {"dimensions": [1, 1, 1], "data": "AQ=="}
WITH_NAN = "v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 2 3 4\n"


@pytest.mark.parametrize(
    ("format_", "content"),
    [
        ("stl", b""),
        ("stl", b"\xff" * 200),  # the header promises four billion triangles
        ("stl", b"\0" * 84),
        ("stl", b"solid nothing\nfacet"),
        ("obj", b""),
        ("obj", b"hello"),
        ("obj", b"v 0 0 0\nf 1 2 3\n"),
        ("obj", WITH_NAN.encode()),
        ("obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        ("obj", b"mtllib /etc/passwd\nv 0 0 0\n"),
        ("glb", b""),
        ("glb", b"glTF" + b"\0" * 40),
        ("glb", b"\xff" * 200),
        ("glb", glb(**BOMB)),
        ("glb", glb(**REPEATED)),
        ("glb", glb(nodes=[{}] * 5000)),
        ("glb", glb(nodes={"a": 1})),
        ("glb", torus().export(file_type="glb")[:3000]),
    ],
)
def test_a_broken_file_is_refused_at_its_field(format_: Any, content: bytes) -> None:
    with refusal_of("data"):
        mesh_from_file(format_, base64_of(content), 1.0)


def test_too_many_triangles_are_refused() -> None:
    stl = (
        b"\0" * 80
        + struct.pack("<I", CLOUD_RANGES.max_triangles + 1)
        + bytes(50) * (CLOUD_RANGES.max_triangles + 1)
    )
    with refusal_of("data", match="simplify the mesh"):
        mesh_from_file("stl", base64_of(stl), 1.0)


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"shape": "points", "points": [[200.0, 0.0, 0.0]], "radius": 0.1}, "points"),
        ({"shape": "voxels", "size": 0.1}, "cells"),
        ({"shape": "voxels", "size": 0.1, "cells": [[0, 0, 0]], "bits": ONE_BIT}, "cells"),
        (
            {"shape": "voxels", "size": 0.1, "bits": {"dimensions": [1, 1, 1], "data": "AAAA"}},
            "bits.data",
        ),
        (
            {"shape": "voxels", "size": 0.1, "bits": {"dimensions": [1, 1, 1], "data": "AAAAA"}},
            "bits.data",
        ),
        (
            {"shape": "voxels", "size": 0.1, "bits": {"dimensions": [2, 2, 2], "data": "AA=="}},
            "cells",
        ),
        (
            {
                "shape": "voxels",
                "size": 0.1,
                "bits": {"dimensions": [4096, 4096, 1], "data": "AA=="},
            },
            "bits.dimensions",
        ),
        ({"shape": "mesh_file", "format": "stl", "data": "AAAAA"}, "data"),
        ({"shape": "mesh_file", "format": "obj", "data": MESH_FILE}, "data"),
        ({"shape": "mesh_file", "format": "stl", "data": MESH_FILE, "scale": 1000.0}, "scale"),
    ],
)
def test_bad_obstacles_name_the_field(fields: dict[str, Any], field: str) -> None:
    with refusal_of(f"scene.obstacles.0.{field}"):
        shape_of(**fields)


def test_all_cells_of_the_greatest_grid_fit() -> None:
    """Only the last cell is occupied: the text of the bits fits the longest text of the
    contract.
    """
    grid = np.zeros((256, 256, 128), dtype=bool)
    assert grid.size == MOST_CELLS
    grid[-1, -1, -1] = True
    shape = shape_of(
        shape="voxels", size=0.01, bits={"dimensions": [256, 256, 128], "data": bits_of(grid)}
    )
    assert shape.cells.tolist() == [[255, 255, 127]]


def test_a_file_is_read_once_for_each_scale() -> None:
    found, twice = (mesh_from_file("stl", MESH_FILE, scale) for scale in (0.001, 0.002))
    assert mesh_from_file("stl", MESH_FILE, 0.001) is found
    assert twice.corners == pytest.approx(2 * found.corners)


def file_of(count: int, seed: int) -> str:
    """An STL file of triangles at random, in base64."""
    corners = np.random.default_rng(seed).uniform(-0.9, 0.9, (3 * count, 3))
    faces = np.arange(3 * count).reshape(-1, 3)
    return base64_of(trimesh.Trimesh(corners, faces, process=False).export(file_type="stl"))


@pytest.mark.long
def test_the_mesh_that_rested_longest_leaves_a_full_cache() -> None:
    kept, fit = mesh_file._mesh, MOST_KEPT_TRIANGLES // CLOUD_RANGES.max_triangles
    kept.cache_clear()
    files = [file_of(CLOUD_RANGES.max_triangles, seed) for seed in range(fit + 1)]
    made = [mesh_from_file("stl", file, 1.0) for file in files[:fit]]
    # The limit holds for triangles, not for files.
    assert kept.cache.currsize == MOST_KEPT_TRIANGLES == kept.cache.maxsize
    assert mesh_from_file("stl", files[0], 1.0) is made[0]  # now the second one has rested longest
    made.append(mesh_from_file("stl", files[fit], 1.0))
    assert kept.cache.currsize == MOST_KEPT_TRIANGLES
    again = [mesh_from_file("stl", files[k], 1.0) is made[k] for k in (0, *range(2, fit + 1), 1)]
    assert again == [True] * fit + [False]
    kept.cache_clear()
