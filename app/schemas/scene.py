"""What stands around the arm and what is fixed to its flange: shapes with their poses."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from app.schemas.common import IDENTITY, Pose, Request, RobotName, Vector3, described

# the optimizer refuses more; here so that the schema says so
MOST_OBSTACLES, MOST_VERTICES, MOST_CAPSULES = 64, 256, 16
_POSE = {"position": [0.5, 0.1, 0.2], "quaternion": [0.0, 0.0, 0.0, 1.0]}
_POSE_TEXT = "Pose of the shape: in the base frame for an obstacle, in the flange frame for what the arm carries."
Size = Annotated[float, Field(ge=1e-4, le=100)]


class _Shape(Request):
    pose: Pose = described(_POSE_TEXT, None, _POSE, default=IDENTITY)


class Box(_Shape):
    """A box about its pose's origin."""

    shape: Literal["box"] = described("Kind of shape.", None, "box")
    size: Annotated[list[Size], Field(min_length=3, max_length=3)] = described(
        "Edges along the pose's axes.", "m", [0.4, 0.3, 0.2]
    )


class Sphere(_Shape):
    """A ball about its pose's origin."""

    shape: Literal["sphere"] = described("Kind of shape.", None, "sphere")
    radius: Size = described("Radius.", "m", 0.08)


class Cylinder(_Shape):
    """A cylinder along its pose's z axis, the origin in its middle."""

    shape: Literal["cylinder"] = described("Kind of shape.", None, "cylinder")
    radius: Size = described("Radius.", "m", 0.05)
    length: Size = described("Length.", "m", 0.4)


class Capsule(_Shape):
    """A segment along its pose's z axis, grown by a radius; the origin is in its middle."""

    shape: Literal["capsule"] = described("Kind of shape.", None, "capsule")
    radius: Size = described("Radius.", "m", 0.05)
    length: Size = described("Length of the segment, without the round ends.", "m", 0.4)


class Mesh(_Shape):
    """The convex hull of points: a body that is not convex is given as several."""

    shape: Literal["mesh"] = described("Kind of shape.", None, "mesh")
    vertices: Annotated[list[Vector3], Field(min_length=4, max_length=MOST_VERTICES)] = described(
        "Points whose hull it is; they must span a body.",
        "m",
        [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]],
    )


class HalfSpace(_Shape):
    """All that lies below its pose's xy plane: a floor, or a wall whose z axis points at the arm."""

    shape: Literal["half_space"] = described("Kind of shape.", None, "half_space")


class _Obstacle(Request):
    name: Annotated[str, Field(min_length=1, max_length=64)] = described(
        "Its name in answers, unlike any other's.", None, "table"
    )
    margin: float = described("How far the arm keeps away from it.", "m", 0.02, default=0.0, ge=0, le=1)


class BoxObstacle(Box, _Obstacle):
    """A box in the arm's surroundings."""


class SphereObstacle(Sphere, _Obstacle):
    """A ball in the arm's surroundings."""


class CylinderObstacle(Cylinder, _Obstacle):
    """A cylinder in the arm's surroundings."""


class CapsuleObstacle(Capsule, _Obstacle):
    """A capsule in the arm's surroundings."""


class MeshObstacle(Mesh, _Obstacle):
    """A convex body in the arm's surroundings."""


class HalfSpaceObstacle(HalfSpace, _Obstacle):
    """A floor or a wall."""


def _by_shape(*known: str) -> Discriminator:
    """Chooses a union's member by its `shape`, without repeating what is not known."""

    def choose(value: Any) -> str | None:
        shape = value.get("shape") if isinstance(value, dict) else getattr(value, "shape", None)
        return shape if shape in known else None

    return Discriminator(
        choose,
        custom_error_type="unknown_shape",
        custom_error_message=f"Give an object whose `shape` is one of {', '.join(known)}",
    )


CarriedShape = Annotated[
    Annotated[Box, Tag("box")]
    | Annotated[Sphere, Tag("sphere")]
    | Annotated[Cylinder, Tag("cylinder")]
    | Annotated[Capsule, Tag("capsule")]
    | Annotated[Mesh, Tag("mesh")],
    _by_shape("box", "sphere", "cylinder", "capsule", "mesh"),
]


class Carried(Request):
    """The space that a carried body takes up."""

    shape: CarriedShape = described(
        "Its shape, with its pose in the flange frame.",
        None,
        {"shape": "box", "size": [0.1, 0.1, 0.2], "pose": {"position": [0, 0, 0.2], "rotvec": [0, 0, 0]}},
    )


Obstacle = Annotated[
    Annotated[BoxObstacle, Tag("box")]
    | Annotated[SphereObstacle, Tag("sphere")]
    | Annotated[CylinderObstacle, Tag("cylinder")]
    | Annotated[CapsuleObstacle, Tag("capsule")]
    | Annotated[MeshObstacle, Tag("mesh")]
    | Annotated[HalfSpaceObstacle, Tag("half_space")],
    _by_shape("box", "sphere", "cylinder", "capsule", "mesh", "half_space"),
]


class Scene(Request):
    """What surrounds the arm, in its base frame."""

    obstacles: Annotated[list[Obstacle], Field(max_length=MOST_OBSTACLES)] = described(
        "The obstacles.",
        None,
        [{"name": "floor", "shape": "half_space", "pose": {"position": [0, 0, -0.1], "rotvec": [0, 0, 0]}}],
        default=[],
    )


class ToolCapsule(Request):
    """A segment in the flange frame, grown by a radius."""

    start: Vector3 = described("One end of the segment, in the flange frame.", "m", [0.0, 0.0, 0.03])
    end: Vector3 = described("Its other end.", "m", [0.0, 0.0, 0.12])
    radius: Size = described("Radius.", "m", 0.04)


class Tool(Request):
    """What the flange bears, for collisions."""

    capsules: Annotated[list[ToolCapsule], Field(max_length=MOST_CAPSULES)] = described(
        "Capsules that the tool lies within.",
        None,
        [{"start": [0.0, 0.0, 0.03], "end": [0.0, 0.0, 0.12], "radius": 0.04}],
        default=[],
    )


class CellRequest(Request):
    """The robot, its tool, and what surrounds it."""

    robot: RobotName = described("A name from `GET /robots`.", None, "ur5e", default="ur5e")
    tcp: Pose = described(
        "Pose of the TCP in the flange frame.",
        None,
        {"position": [0.0, 0.0, 0.12], "rpy": [0.0, 0.0, 0.0]},
        default=IDENTITY,
    )
    tool: Tool = described(
        "The tool at the flange, for collisions with it.",
        None,
        {"capsules": [{"start": [0.0, 0.0, 0.03], "end": [0.0, 0.0, 0.12], "radius": 0.04}]},
        default=Tool(),
    )
    scene: Scene = described(
        "What surrounds the arm.",
        None,
        {"obstacles": [{"name": "post", "shape": "cylinder", "radius": 0.05, "length": 1.0}]},
        default=Scene(),
    )
