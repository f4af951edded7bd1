"""Shapes for collision checking: obstacles around the arm, and the tool at its flange."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from joulepath.app.schemas.common import (
    IDENTITY,
    NO_CONTROLS,
    PLAIN,
    Frame,
    Pose,
    Request,
    RobotWithTcp,
    Vector3,
    described,
    frame_of,
)
from joulepath.app.schemas.examples.values import BOX, MESH_FILE, TOOL, at
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.models.shape_sizes import SIZES
from joulepath.optimizer.problem.arm import ARM_RANGES
from joulepath.optimizer.problem.clouds import CLOUD_RANGES
from joulepath.optimizer.problem.names import LONGEST_NAME
from joulepath.optimizer.problem.scene import SCENE_RANGES

_POSE = {"position": [0.5, 0.1, 0.2], "quaternion": [0.0, 0.0, 0.0, 1.0]}
_POSE_TEXT = (
    "Pose of the shape: of an obstacle in the scene's `frame`, of a payload in the flange frame."
)
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


class _Obstacle(Request):
    name: Annotated[
        str, Field(min_length=1, max_length=LONGEST_NAME, pattern=NO_CONTROLS), PLAIN
    ] = described(
        "Name of the obstacle in answers. Each name is used once, and none is a link's, `tool` or "
        "`payload`; names that differ only in case or spaces count as the same. Every character "
        "must show.",
        None,
        "table",
    )
    margin: float = described(
        "Required clearance between the arm and this obstacle; 0 allows contact.",
        "m",
        0.02,
        default=SCENE_RANGES.default_margin,
        ge=0,
        le=1,
    )


class BoxObstacle(Box, _Obstacle):
    """An obstacle in the shape of a box."""


class SphereObstacle(Sphere, _Obstacle):
    """An obstacle in the shape of a sphere."""


class CylinderObstacle(Cylinder, _Obstacle):
    """An obstacle in the shape of a cylinder."""


class CapsuleObstacle(Capsule, _Obstacle):
    """An obstacle in the shape of a capsule."""


class MeshObstacle(Mesh, _Obstacle):
    """An obstacle in the shape of a convex mesh."""


class PointsObstacle(Points, _Obstacle):
    """An obstacle that is a point cloud."""


class VoxelsObstacle(Voxels, _Obstacle):
    """An obstacle that is a grid of voxels."""


class MeshFileObstacle(MeshFile, _Obstacle):
    """An obstacle from a mesh file."""


class HalfSpaceObstacle(HalfSpace, _Obstacle):
    """An obstacle that is a floor or a wall."""


def _by_shape(*known: str) -> Discriminator:
    """Discriminator of a union by the field `shape`, whose members are tagged `a <shape>`.

    Its error does not echo an unknown shape. A tag that were the name of a field, as `points` is,
    would be taken for one in the location of an error.
    """

    def choose(value: Any) -> str | None:
        shape = value.get("shape") if isinstance(value, dict) else getattr(value, "shape", None)
        return f"a {shape}" if shape in known else None

    return Discriminator(
        choose,
        custom_error_type="unknown_shape",
        custom_error_message=f"Give an object whose `shape` is one of {', '.join(known)}",
    )


CarriedShape = Annotated[
    Annotated[Box, Tag("a box")]
    | Annotated[Sphere, Tag("a sphere")]
    | Annotated[Cylinder, Tag("a cylinder")]
    | Annotated[Capsule, Tag("a capsule")]
    | Annotated[Mesh, Tag("a mesh")],
    _by_shape("box", "sphere", "cylinder", "capsule", "mesh"),
]


LinkNames = Annotated[
    list[Annotated[str, Field(min_length=1, max_length=64)]], Field(max_length=16)
]


def touched_links(body: str) -> Any:
    """The field `touches` of a body that is fixed to the flange."""
    return described(
        f"Names of the links that the {body} touches by design: their distance from it is not "
        "checked. Null: the link that carries the flange (`wrist_3`). An empty list: none.",
        None,
        ["wrist_3"],
        default=None,
    )


class CarriedBody(Request):
    """A payload for collision checking, without a mass."""

    shape: CarriedShape = described(
        "Shape of the payload, with its pose in the flange frame.",
        None,
        BOX,
    )
    touches: LinkNames | None = touched_links("payload")


Obstacle = Annotated[
    Annotated[BoxObstacle, Tag("a box")]
    | Annotated[SphereObstacle, Tag("a sphere")]
    | Annotated[CylinderObstacle, Tag("a cylinder")]
    | Annotated[CapsuleObstacle, Tag("a capsule")]
    | Annotated[MeshObstacle, Tag("a mesh")]
    | Annotated[HalfSpaceObstacle, Tag("a half_space")]
    | Annotated[PointsObstacle, Tag("a points")]
    | Annotated[VoxelsObstacle, Tag("a voxels")]
    | Annotated[MeshFileObstacle, Tag("a mesh_file")],
    _by_shape(
        "box",
        "sphere",
        "cylinder",
        "capsule",
        "mesh",
        "half_space",
        "points",
        "voxels",
        "mesh_file",
    ),
]


class Scene(Request):
    """The surroundings of the arm."""

    obstacles: Annotated[list[Obstacle], Field(max_length=SCENE_RANGES.max_obstacles)] = described(
        "Obstacles around the arm.",
        None,
        [{"name": "floor", "shape": "half_space", "pose": at(0.0, 0.0, -0.1)}],
        default=[],
    )
    frame: Frame = frame_of("the obstacles' poses")


class ToolCapsule(Request):
    """A capsule in the flange frame."""

    start: Vector3 = described(
        "First end of the axis, [x, y, z] in the flange frame.", "m", [0.0, 0.0, 0.03]
    )
    end: Vector3 = described(
        "Second end of the axis, [x, y, z] in the flange frame.", "m", [0.0, 0.0, 0.12]
    )
    radius: Size = described("Radius.", "m", 0.04)
    touches: LinkNames | None = touched_links("capsule")


class Tool(Request):
    """The shape of the tool, for collision checking."""

    capsules: Annotated[list[ToolCapsule], Field(max_length=ARM_RANGES.max_tool_parts)] = described(
        "Capsules that enclose the tool.",
        None,
        TOOL["capsules"],
        default=[],
    )


ToolName = Annotated[str, Field(min_length=1, max_length=LENGTHS.tool)]


def _name_or_shape(value: Any) -> str | None:
    """Discriminator of a union of a string, tagged `name`, and an object, tagged `shape`."""
    if isinstance(value, str):
        return "name"
    return "shape" if isinstance(value, dict | Tool) else None


class CellRequest(RobotWithTcp):
    """The robot, its tool and its surroundings."""

    tool: Annotated[
        Annotated[ToolName, Tag("name")] | Annotated[Tool, Tag("shape")],
        Discriminator(
            _name_or_shape,
            custom_error_type="name_or_shape",
            custom_error_message="Give the name of a tool, or an object with its capsules",
        ),
    ] = described(
        "Shape of the tool, for collision checking; or the name of a tool from `GET /tools`. A "
        "name also gives the TCP, unless `tcp` is given, and adds the tool's mass to every "
        "payload, which is then the part alone.",
        None,
        "robotiq_2f_85",
        default=Tool(),
    )
    scene: Scene = described(
        "Obstacles around the arm.",
        None,
        {
            "obstacles": [
                {
                    "name": "post",
                    "shape": "cylinder",
                    "radius": 0.05,
                    "length": 1.0,
                    "pose": at(0.6, 0.3, 0.5),
                }
            ]
        },
        default=Scene(),
    )
