"""Obstacles around the arm and shapes fixed to its flange. Validated on construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES, hull_of_body
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import check_size, frozen, placement, sized
from joulepath.optimizer.problem.clouds import CLOUD_RANGES, Cloud, parts_of
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.names import check_name, first_repeated
from joulepath.optimizer.problem.scalars import check_number


@dataclass(frozen=True)
class SceneRanges:
    """Ranges of obstacles and of their shapes."""

    max_obstacles: int = 64
    """Most obstacles of a scene; the limits bound the work of a request."""
    max_vertices: int = 256
    """Most vertices of a mesh."""
    default_margin: float = 5e-3
    """Default clearance of an obstacle [m]: the accuracy of the placement of bodies in a cell."""
    greatest_margin: float = 1.0
    """Greatest clearance of an obstacle [m]."""


SCENE_RANGES = SceneRanges()


@dataclass(frozen=True)
class Sphere:
    """A ball of `radius` [m] about the origin."""

    radius: float

    def __post_init__(self) -> None:
        check_size("radius", self.radius)


@dataclass(frozen=True)
class _AlongZ:
    """Body of revolution of `radius` and `length` [m] along z, centred at the origin."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        check_size("radius", self.radius)
        check_size("length", self.length)


@dataclass(frozen=True)
class Capsule(_AlongZ):
    """A segment of `length` [m] along z, centred at the origin, grown by `radius` [m]."""


@dataclass(frozen=True)
class Cylinder(_AlongZ):
    """A cylinder of `radius` [m] and `length` [m] along z, centred at the origin."""


@dataclass(frozen=True)
class Box:
    """A box with edges `size` (3,) [m] along the axes, centred at the origin."""

    size: Array

    def __post_init__(self) -> None:
        size = frozen(self.size, (3,), "size")
        for edge in size.tolist():
            check_size("size", edge)
        object.__setattr__(self, "size", size)


@dataclass(frozen=True)
class HalfSpace:
    """All points below z = 0: a floor, or a wall with its z axis into free space."""


@dataclass(frozen=True)
class Mesh:
    """Convex hull of `vertices` (n, 3) [m], grown by `radius` [m].

    Raises:
        InvalidProblem: the vertices lie in a plane, or close together.
    """

    vertices: Array
    radius: float = 0.0

    def __post_init__(self) -> None:
        vertices = frozen(self.vertices, (-1, 3), "vertices")
        if not 4 <= len(vertices) <= SCENE_RANGES.max_vertices:
            raise InvalidProblem(
                "vertices", f"vertices must be 4 to {SCENE_RANGES.max_vertices} points."
            )
        if np.abs(vertices).max() > SIZES.largest:
            raise InvalidProblem(
                "vertices", f"vertices must lie within {SIZES.largest:g} m of the origin."
            )
        hull = sized("vertices", lambda: hull_of_body("vertices", vertices))
        object.__setattr__(self, "vertices", frozen(hull, (-1, 3), "vertices"))


Shape = Sphere | Capsule | Cylinder | Box | HalfSpace | Mesh | Cloud


@dataclass(frozen=True)
class Obstacle:
    """A shape in the base frame with a required clearance.

    Attributes:
        name: name in answers; see `joulepath.optimizer.problem.names`.
        shape: the shape.
        T_base_shape: its pose in the base frame, shape (4, 4).
        margin: required clearance from the arm [m].

    Raises:
        InvalidProblem: a value is malformed; names the field.
    """

    name: str
    shape: Shape
    T_base_shape: Array = field(default_factory=lambda: np.eye(4))
    margin: float = SCENE_RANGES.default_margin

    def __post_init__(self) -> None:
        check_fields(self)
        check_name("name", self.name)
        check_number("margin", self.margin, "metres", most=SCENE_RANGES.greatest_margin)
        object.__setattr__(self, "T_base_shape", placement(self.T_base_shape, "pose"))


@dataclass(frozen=True)
class Attachment:
    """A shape fixed to the flange: part of a tool, or the payload.

    Attributes:
        shape: the shape.
        T_flange_shape: its pose in the flange frame, shape (4, 4).
        touches: names of the links it touches by design, with unchecked distances; None for the
            link of the flange.
        is_hull: whether it covers the tool more closely than the parts without this mark: in their
            place, it is compared with obstacles, except clouds.

    Raises:
        InvalidProblem: the shape cannot be carried, or a value is malformed.
    """

    shape: Shape
    T_flange_shape: Array = field(default_factory=lambda: np.eye(4))
    touches: Sequence[str] | None = None
    is_hull: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if isinstance(self.shape, HalfSpace):
            raise InvalidProblem("shape", "A half-space cannot be carried: use a box.")
        if isinstance(self.shape, Cloud):
            raise InvalidProblem(
                "shape", "Points, voxels and mesh files cannot be carried: use a `mesh` or a box."
            )
        object.__setattr__(self, "T_flange_shape", placement(self.T_flange_shape, "shape"))
        if self.touches is not None:
            object.__setattr__(self, "touches", tuple(self.touches))


@dataclass(frozen=True)
class Scene:
    """Obstacles with distinct names.

    Raises:
        InvalidProblem: two names are equal in normalized form, or there are too many obstacles.
    """

    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        check_fields(self, "scene.")
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        if len(self.obstacles) > SCENE_RANGES.max_obstacles:
            raise InvalidProblem(
                "scene.obstacles", f"A scene has at most {SCENE_RANGES.max_obstacles} obstacles."
            )
        parts = sum(parts_of(o.shape) for o in self.obstacles if isinstance(o.shape, Cloud))
        if parts > CLOUD_RANGES.max_parts_in_scene:
            raise InvalidProblem(
                "scene.obstacles",
                f"The points, voxels and triangles of a scene are {parts}: give at most "
                f"{CLOUD_RANGES.max_parts_in_scene} in all.",
            )
        repeated = first_repeated(self.names)
        if repeated is not None:
            raise InvalidProblem(
                f"scene.obstacles.{repeated}.name",
                "Two obstacles have the same name, apart from case and spaces: rename one of them.",
            )

    @property
    def names(self) -> list[str]:
        """Names of the obstacles."""
        return [obstacle.name for obstacle in self.obstacles]


def capsule_between(
    first: Array, second: Array, radius: float, touches: Sequence[str] | None = None
) -> Attachment:
    """A capsule fixed to the flange around a segment: a part of a tool.

    Args:
        first: one end of the segment in the flange frame, shape (3,) [m].
        second: the other end; if both coincide, the shape is a sphere.
        radius: radius of the capsule [m].
        touches: names of the links it touches by design, as in `Attachment`.

    Returns:
        The shape, for `Arm(tool=[…])`.

    Raises:
        InvalidProblem: an end is not finite, or no body has this size.
    """
    ends = frozen([first, second], (2, 3), "tool.capsules")
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    T = np.eye(4)
    T[:3, 3] = ends.mean(axis=0)
    if length < SIZES.smallest:
        return Attachment(Sphere(radius + length / 2), T, touches)
    T[:3, :3] = rotation_to(along / length)
    return Attachment(Capsule(radius, length), T, touches)


def rotation_to(z: Array) -> Array:
    """A rotation (3, 3) whose z axis is a given unit vector (3,), about which it is free."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
