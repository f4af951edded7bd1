"""Admissible places of a robot base, or of a group of stops and obstacles; validated on
construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.shape_sizes import SIZES
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import frozen, placement
from joulepath.optimizer.problem.declared_types import check_fields, check_type

Mount = Literal["floor", "wall", "ceiling"]
Coordinate = Literal["x", "y", "z", "yaw"]
Range = tuple[float, float]
COORDINATES: tuple[Coordinate, ...] = get_args(Coordinate)
"""Coordinates of a place: a position [m], and the angle about the world's z axis [rad]."""


@dataclass(frozen=True)
class RegionRanges:
    """Ranges of regions."""

    max_places: int = 1000
    """Most places of a list; each of them takes a cycle."""
    widest_yaw: float = 4 * np.pi
    """Greatest absolute yaw [rad]: two full turns, so that a range may begin at any yaw."""


REGION_RANGES = RegionRanges()


@dataclass(frozen=True, kw_only=True)
class Region:
    """Ranges of a place in the world.

    For the robot base, the ranges apply to the pose of the base frame in the world. For a group of
    stops and obstacles, they apply to offsets from the given poses. None keeps the nominal value.

    Attributes:
        x: least and greatest x [m].
        y: least and greatest y [m].
        z: least and greatest z [m].
        yaw: least and greatest angle about the world's z axis [rad]: the angle of the x axis of a
            base on the floor or the ceiling, or of the z axis of a base on a wall.
        mounts: allowed orientations of the base: on the "floor" with its z axis up, on a "wall"
            with its z axis horizontal along yaw and its x axis down, on the "ceiling" with its z
            axis down and its y axis at a right angle to yaw. None keeps the nominal orientation,
            turned by yaw alone.

    Raises:
        InvalidProblem: a range is empty or not finite; names the field.
    """

    x: Range | None = None
    y: Range | None = None
    z: Range | None = None
    yaw: Range | None = None
    mounts: Sequence[Mount] | None = None

    def __post_init__(self) -> None:
        check_fields(self, "region.")
        for name in COORDINATES:
            given = getattr(self, name)
            if given is None:
                continue
            most = REGION_RANGES.widest_yaw if name == "yaw" else SIZES.largest
            low, high = frozen(given, (2,), f"region.{name}").tolist()
            if not -most <= low <= high <= most:
                raise InvalidProblem(
                    f"region.{name}",
                    f"region.{name} is empty or too wide: give the least value first, then the "
                    f"greatest, within ±{most:.4g}.",
                )
            object.__setattr__(self, name, (low, high))
        if self.mounts is not None:
            mounts = tuple(dict.fromkeys(self.mounts))
            if not mounts:
                raise InvalidProblem(
                    "region.mounts",
                    f"region.mounts must have at least one of {', '.join(get_args(Mount))}.",
                )
            object.__setattr__(self, "mounts", mounts)

    def range_of(self, name: Coordinate) -> Range | None:
        """The range of a coordinate; None if it keeps its nominal value."""
        found: Range | None = getattr(self, name)
        return found


@dataclass(frozen=True)
class Places:
    """A list of places: poses (4, 4) of the base in the world, or offsets of a group.

    Raises:
        InvalidProblem: there are none or too many, or one is no rigid transform.
    """

    poses: Sequence[Array]

    def __post_init__(self) -> None:
        check_fields(self, "region.")
        if not 1 <= len(self.poses) <= REGION_RANGES.max_places:
            raise InvalidProblem(
                "region.places",
                f"region.places must have 1 to {REGION_RANGES.max_places} poses.",
            )
        checked = tuple(placement(pose, f"region.places.{k}") for k, pose in enumerate(self.poses))
        object.__setattr__(self, "poses", checked)


@dataclass(frozen=True)
class Group:
    """Stops and obstacles moved together as one rigid body, such as a fixture or a pallet.

    Attributes:
        stops: names of stops, in all cycles with such stops; `start` is the start of a cycle.
        obstacles: names of obstacles, in the scenes of all cycles with such obstacles.

    Raises:
        InvalidProblem: the group is empty, or names a stop or an obstacle twice.
    """

    stops: Sequence[str] = ()
    obstacles: Sequence[str] = ()

    def __post_init__(self) -> None:
        check_fields(self, "moves.")
        for name in ("stops", "obstacles"):
            names = tuple(getattr(self, name))
            object.__setattr__(self, name, names)
            if len(set(names)) < len(names):
                raise InvalidProblem(
                    f"moves.{name}", f"moves.{name} names the same one twice: name each once."
                )
        if not self.stops and not self.obstacles:
            raise InvalidProblem(
                "moves", "moves names nothing: name the stops and the obstacles that move."
            )


@dataclass(frozen=True)
class Moved:
    """A movable body and its admissible places.

    Attributes:
        region: allowed places.
        moves: "base", or a group of stops and obstacles.

    Raises:
        InvalidProblem: a group has a mount, or a field another type.
    """

    region: Region | Places
    moves: Literal["base"] | Group = "base"

    def __post_init__(self) -> None:
        check_fields(self)
        if not (isinstance(self.moves, str) and self.moves == "base"):
            check_type("moves", self.moves, Group)
        if (
            isinstance(self.moves, Group)
            and isinstance(self.region, Region)
            and self.region.mounts is not None
        ):
            raise InvalidProblem(
                "region.mounts", "Only the base has a mount: leave region.mounts out for a group."
            )
