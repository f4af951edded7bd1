"""Shapes of bodies in requests."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import (
    IDENTITY,
    Pose,
    Request,
    Vector3,
    described,
)
from joulepath.app.schemas.examples.values import MESH_FILE
from joulepath.models.shape_sizes import SIZES
from joulepath.optimizer.problem.clouds import CLOUD_RANGES
from joulepath.optimizer.problem.scene import SCENE_RANGES

# standard alphabet, filled to a multiple of four characters
BASE64 = r"^[A-Za-z0-9+/]*={0,2}$"


MOST_CELLS = 1 << 23
"""Most cells of a grid given as bits."""


MOST_FILE_BYTES = 1 << 22
"""Largest mesh file [byte]."""


MOST_BITS_TEXT = 4 * -(-MOST_CELLS // 8 // 3) + 4
"""Longest base64 text of a grid."""


MOST_FILE_TEXT = 4 * -(-MOST_FILE_BYTES // 3)
"""Longest base64 text of a mesh file."""


Size = Annotated[float, Field(ge=SIZES.smallest, le=SIZES.largest)]


_POSE = {"position": [0.5, 0.1, 0.2], "quaternion": [0.0, 0.0, 0.0, 1.0]}
_POSE_TEXT = (
    "Pose of the shape: of an obstacle in the scene's `frame`, of a payload in the flange frame."
)


class _Shape(Request):
    pose: Pose = described(_POSE_TEXT, None, _POSE, default=IDENTITY)


class Box(_Shape):
    """A box, centred at the origin of its pose."""

    shape: Literal["box"] = described("Kind of shape.", None, "box")
    size: Annotated[list[Size], Field(min_length=3, max_length=3)] = described(
        "Lengths of the edges along the axes x, y, z of the pose.", "m", [0.4, 0.3, 0.2]
    )


class Sphere(_Shape):
    """A sphere, centred at the origin of its pose."""

    shape: Literal["sphere"] = described("Kind of shape.", None, "sphere")
    radius: Size = described("Radius.", "m", 0.08)


class Cylinder(_Shape):
    """A cylinder along the z axis of its pose, centred at the origin."""

    shape: Literal["cylinder"] = described("Kind of shape.", None, "cylinder")
    radius: Size = described("Radius.", "m", 0.05)
    length: Size = described("Length.", "m", 0.4)


class Capsule(_Shape):
    """A capsule along the z axis of its pose, centred at the origin."""

    shape: Literal["capsule"] = described("Kind of shape.", None, "capsule")
    radius: Size = described("Radius.", "m", 0.05)
    length: Size = described("Length without the round ends.", "m", 0.4)


class Mesh(_Shape):
    """The convex hull of points. An obstacle that is not convex is a `mesh_file`, or several
    meshes.
    """

    shape: Literal["mesh"] = described("Kind of shape.", None, "mesh")
    vertices: Annotated[
        list[Vector3], Field(min_length=4, max_length=SCENE_RANGES.max_vertices)
    ] = described(
        "Points [x, y, z] in the frame of the pose. Their convex hull must have a volume.",
        "m",
        [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]],
    )


class HalfSpace(_Shape):
    """All points below the xy plane of its pose: a floor, or a wall whose z axis points to the
    arm."""

    shape: Literal["half_space"] = described("Kind of shape.", None, "half_space")


class Points(_Shape):
    """Balls of one radius about points: a point cloud. Every point counts; none is left out or
    merged.
    """

    shape: Literal["points"] = described("Kind of shape.", None, "points")
    points: Annotated[list[Vector3], Field(min_length=1, max_length=CLOUD_RANGES.max_points)] = (
        described(
            "Points [x, y, z] in the frame of the pose.",
            "m",
            [[0.4, 0.1, 0.0], [0.4, 0.12, 0.0], [0.4, 0.14, 0.01]],
        )
    )
    radius: Size = described(
        "Radius of the ball about each point: at least half of the distance between neighbours, so "
        "that nothing passes between them.",
        "m",
        0.015,
    )


class VoxelBits(Request):
    """The occupied cells of a grid as one bit each."""

    dimensions: Annotated[
        list[Annotated[int, Field(ge=1, le=CLOUD_RANGES.max_along_edge)]],
        Field(min_length=3, max_length=3),
    ] = described(
        "Number of cells along x, y and z; at most 8,388,608 cells in all.", None, [4, 2, 2]
    )
    data: Annotated[str, Field(min_length=4, max_length=MOST_BITS_TEXT, pattern=BASE64)] = (
        described(
            "Base64 of the bits, eight to a byte, the lowest bit first; 1: occupied. Cell (i, j, "
            "k) is bit i + dimensions[0] · (j + dimensions[1] · k). The last byte is filled with "
            "zeros.",
            None,
            "AwE=",
        )
    )


class Voxels(_Shape):
    """Cubes of a grid: an occupancy map. The pose is that of the corner of cell (0, 0, 0) with the
    least x, y and z.
    """

    shape: Literal["voxels"] = described("Kind of shape.", None, "voxels")
    size: Size = described("Length of the edges of a cell.", "m", 0.05)
    cells: (
        Annotated[
            list[
                Annotated[
                    list[
                        Annotated[
                            int,
                            Field(ge=-CLOUD_RANGES.max_along_edge, le=CLOUD_RANGES.max_along_edge),
                        ]
                    ],
                    Field(min_length=3, max_length=3),
                ]
            ],
            Field(min_length=1, max_length=CLOUD_RANGES.max_voxels),
        ]
        | None
    ) = described(
        "Occupied cells [i, j, k]: each is the cube from (i, j, k) · size to (i + 1, j + 1, k + 1) "
        "· size. Give either `cells` or `bits`.",
        None,
        [[0, 0, 0], [1, 0, 0], [1, 0, 1]],
        default=None,
    )
    bits: VoxelBits | None = described(
        "Occupied cells as bits: a hundred times smaller for dense grids. Give either `cells` or "
        "`bits`.",
        None,
        {"dimensions": [4, 2, 2], "data": "AwE="},
        default=None,
    )


class MeshFile(_Shape):
    """Triangles from a mesh file, of any form. Every triangle counts: nothing is simplified or made
    convex.

    A closed mesh, in which every edge belongs to two triangles of opposite directions, is solid.
    Any other mesh is a surface.
    """

    shape: Literal["mesh_file"] = described("Kind of shape.", None, "mesh_file")
    format: Literal["stl", "obj", "glb"] = described(
        "Format of the file: STL (binary or text), Wavefront OBJ, or binary glTF 2.0.", None, "stl"
    )
    data: Annotated[str, Field(min_length=4, max_length=MOST_FILE_TEXT, pattern=BASE64)] = (
        described("Base64 of the file, of at most 4 MiB and 100,000 triangles.", None, MESH_FILE)
    )
    scale: Annotated[float, Field(ge=1e-6, le=1e3)] = described(
        "Length of one unit of the file: 0.001 for a file in millimetres.", "m", 0.001, default=1.0
    )
