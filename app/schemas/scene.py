"""Shapes for collision checking: obstacles around the arm, and the tool at its flange."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from joulepath.app.schemas.common import (
    NO_CONTROLS,
    PLAIN,
    Frame,
    Request,
    RobotWithTcp,
    Vector3,
    described,
    frame_of,
)
from joulepath.app.schemas.examples.values import BOX, TOOL, at
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.shapes import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    MeshFile,
    Points,
    Size,
    Sphere,
    Voxels,
)
from joulepath.optimizer.problem.arm import ARM_RANGES
from joulepath.optimizer.problem.names import LONGEST_NAME
from joulepath.optimizer.problem.scene import SCENE_RANGES


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
        "Required clearance between the arm, its tool and its payload and this obstacle. Where the "
        "arm rests, 0.2 mm more is required: draw a surface on which a part lies 1 mm lower, and "
        "give it the margin 0.",
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
    """A point cloud as an obstacle."""


class VoxelsObstacle(Voxels, _Obstacle):
    """A grid of voxels as an obstacle."""


class MeshFileObstacle(MeshFile, _Obstacle):
    """An obstacle from a mesh file."""


class HalfSpaceObstacle(HalfSpace, _Obstacle):
    """A floor or a wall as an obstacle."""


def _by_shape(*known: str) -> Discriminator:
    """Discriminator of a union by the field `shape`; the tags of its members are `a <shape>`.

    The error does not echo an unknown shape. The tags begin with `a `, because the location of an
    error would present a tag such as `points` as a field.
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
    """The field `touches` of a body fixed to the flange."""
    return described(
        f"Names of the links that the {body} touches by design: the distance between such a link "
        f"and the {body} is not checked. Null: the link of the flange (`wrist_3`). An empty list: "
        "none.",
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
        "payload, which then contains only the part.",
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
