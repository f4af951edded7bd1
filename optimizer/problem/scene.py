"""Obstacles around the arm and shapes fixed to its flange, validated on construction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.problem.arrays import LARGEST, numbers, placement

# most obstacles in a scene and most vertices of a mesh: what keeps a request's work bounded
MOST_OBSTACLES, MOST_VERTICES = 64, 256
# sizes and distances [m] outside of these are a mistake of units
SMALLEST = 1e-4
# a hull whose thinnest extent is a smaller part of its widest is flat
FLAT = 1e-6


@dataclass(frozen=True)
class Sphere:
    """A ball of `radius` [m] about the origin."""

    radius: float

    def __post_init__(self) -> None:
        _size("radius", self.radius)


@dataclass(frozen=True)
class Capsule:
    """A segment of `length` [m] along z, its middle in the origin, grown by `radius` [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _size("radius", self.radius)
        _size("length", self.length)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder of `length` [m] along z, its middle in the origin."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _size("radius", self.radius)
        _size("length", self.length)


@dataclass(frozen=True)
class Box:
    """A box with edges `size` (3,) [m] along the axes, its middle in the origin."""

    size: Array

    def __post_init__(self) -> None:
        size = numbers("size", self.size, (3,))
        for edge in size.tolist():
            _size("size", edge)
        object.__setattr__(self, "size", size)


@dataclass(frozen=True)
class HalfSpace:
    """All that lies below z = 0: a floor, or a wall whose z axis points into the room."""


@dataclass(frozen=True)
class Mesh:
    """The convex hull of `vertices` (n, 3) [m]. Raises InvalidProblem when they lie in a plane."""

    vertices: Array

    def __post_init__(self) -> None:
        vertices = numbers("vertices", self.vertices, (-1, 3))
        if not 4 <= len(vertices) <= MOST_VERTICES:
            raise InvalidProblem("vertices", f"vertices must be 4 to {MOST_VERTICES} points.")
        if np.abs(vertices).max() > LARGEST:
            raise InvalidProblem("vertices", f"vertices must lie within {LARGEST:g} m of the origin.")
        extents = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
        if extents[2] <= FLAT * extents[0] or extents[2] < SMALLEST * FLAT:
            raise InvalidProblem("vertices", "vertices lie in a plane: give a body with a volume.")
        try:
            hull = ConvexHull(vertices)
        except QhullError:
            raise InvalidProblem("vertices", "vertices span no body: give points that do not lie in a plane.") from None
        object.__setattr__(self, "vertices", numbers("vertices", vertices[hull.vertices], (-1, 3)))


Shape = Sphere | Capsule | Cylinder | Box | HalfSpace | Mesh


@dataclass(frozen=True)
class Obstacle:
    """A shape in the base frame at `T_base_shape`; the arm keeps `margin` [m] away from it."""

    name: str
    shape: Shape
    T_base_shape: Array = field(default_factory=lambda: np.eye(4))
    margin: float = 0.0

    def __post_init__(self) -> None:
        if not self.name:
            raise InvalidProblem("scene.obstacles", "Every obstacle needs a name.")
        if not (0 <= self.margin <= 1):
            raise InvalidProblem("scene.obstacles", "margin must be between 0 and 1 m.")
        object.__setattr__(self, "T_base_shape", placement("scene.obstacles", self.T_base_shape))


@dataclass(frozen=True)
class Attachment:
    """A shape fixed to the flange at `T_flange_shape`: part of a tool, or what the arm carries."""

    shape: Shape
    T_flange_shape: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        if isinstance(self.shape, HalfSpace):
            raise InvalidProblem("shape", "A half-space cannot be carried: use a box.")
        object.__setattr__(self, "T_flange_shape", placement("shape", self.T_flange_shape))


@dataclass(frozen=True)
class Scene:
    """Obstacles, each under a name of its own."""

    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        if len(self.obstacles) > MOST_OBSTACLES:
            raise InvalidProblem("scene.obstacles", f"A scene holds at most {MOST_OBSTACLES} obstacles.")
        if any(count > 1 for count in Counter(obstacle.name for obstacle in self.obstacles).values()):
            raise InvalidProblem("scene.obstacles", "Two obstacles have the same name: name each differently.")


def capsule_between(first: Array, second: Array, radius: float) -> Attachment:
    """A capsule on the flange around the segment from `first` to `second` (3,) [m]; a sphere where they coincide."""
    ends = numbers("tool.capsules", [first, second], (2, 3))
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    T = np.eye(4)
    T[:3, 3] = ends.mean(axis=0)
    if length < SMALLEST:
        return Attachment(Sphere(radius + length / 2), T)
    z = along / length
    # any x axis across will do
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return Attachment(Capsule(radius, length), T)


def _size(name: str, value: float) -> None:
    # asked so that NaN is refused
    if not SMALLEST <= value <= LARGEST:
        raise InvalidProblem(name, f"{name} must be between {SMALLEST:g} and {LARGEST:g} m.")
