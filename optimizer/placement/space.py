"""The places of a placement: mounts or listed places, and free coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.placement.map_axis import MAP, Axis, most_counts
from joulepath.optimizer.placement.mounts import TILTS, about_z, mount_of, yaw_of
from joulepath.optimizer.placement.moved_cycle import Offsets, composed, cycle_at, inverted
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.region import (
    COORDINATES,
    Group,
    Mount,
    Places,
    Region,
)
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.targets import members

Key = tuple[tuple[int, ...], bytes]


@dataclass(frozen=True, eq=False)
class Place:
    """A place of all movable bodies.

    Attributes:
        choice: index of the mount or of the listed place of every body.
        x: values of the free coordinates, shape (n,) [m, rad].
        poses: pose of the base in the world, or offset of a group, shape (4, 4), of every body.
    """

    choice: tuple[int, ...]
    x: Array
    poses: tuple[Array, ...]

    @property
    def key(self) -> Key:
        """Key of the place; places that differ only by rounding have the same key."""
        return self.choice, (np.round(self.x, 9) + 0.0).tobytes()


@dataclass(frozen=True, eq=False)
class MovableBody:
    """A movable body: its discrete choices, and the nominal values of its coordinates.

    Attributes:
        tilts: rotations (3, 3) at yaw 0; None for listed places.
        places: listed poses (4, 4); None for ranges.
        nominal: nominal coordinates x, y, z [m] and yaw [rad], shape (4,).
        pivot: centre of rotation of a group, shape (3,) [m]; zero for the base.
        mounts: names of the tilts; None for a nominal tilt without a name.
    """

    tilts: tuple[Array, ...] | None
    places: tuple[Array, ...] | None
    nominal: Array
    pivot: Array
    mounts: tuple[Mount | None, ...] = ()

    @property
    def choices(self) -> int:
        """Number of discrete choices; the first choice is the nominal one."""
        return len(self.places if self.places is not None else self.tilts or ())

    def pose(self, choice: int, values: Array) -> Array:
        """The pose (4, 4) at coordinates (4,) [m, rad]."""
        if self.places is not None:
            return self.places[choice]
        assert self.tilts is not None
        turn, T = about_z(values[3]), np.eye(4)
        T[:3, :3] = turn @ self.tilts[choice]
        T[:3, 3] = values[:3] + self.pivot - turn @ self.pivot
        return T


@dataclass(frozen=True, eq=False)
class Space:
    """All places of a placement."""

    placement: Placement
    bodies: tuple[MovableBody, ...]
    axes: tuple[Axis, ...]

    @classmethod
    def of(cls, placement: Placement) -> Space:
        """The places of a placement.

        Raises:
            InvalidProblem: the nominal place is not in a region, or it is the only place.
        """
        bodies, axes = list[MovableBody](), list[Axis]()
        for k, moved in enumerate(placement.moved):
            body = _body(placement, k)
            bodies.append(body)
            if isinstance(moved.region, Region):
                axes += _axes(placement, k, moved.region, body)
        if not axes and all(body.choices == 1 for body in bodies):
            raise InvalidProblem(
                placement.field(0, "region"),
                "The region contains only the nominal place: give a range of x, y, z or yaw, "
                "another mount, or places.",
            )
        if placement.resolution is not None and not axes:
            raise InvalidProblem(
                "resolution", "Listed places have no resolution: leave it out, or give ranges."
            )
        return cls(placement, tuple(bodies), tuple(axes))

    @property
    def choices(self) -> list[tuple[int, ...]]:
        """All combinations of the discrete choices; the first is the nominal one."""
        return list(product(*(range(body.choices) for body in self.bodies)))

    @property
    def nominal(self) -> Place:
        """The nominal place."""
        x = np.array([axis.nominal for axis in self.axes])
        poses = [
            np.eye(4) if isinstance(moved.moves, Group) else self.placement.base
            for moved in self.placement.moved
        ]
        return Place((0,) * len(self.bodies), x, tuple(poses))

    def place(self, choice: tuple[int, ...], x: Array) -> Place:
        """The place with a discrete choice and values (n,) of the axes [m, rad]."""
        poses = list[Array]()
        for k, body in enumerate(self.bodies):
            values = body.nominal.copy()
            for axis, value in zip(self.axes, x, strict=True):
                if axis.body == k:
                    values[COORDINATES.index(axis.name)] = value
            poses.append(body.pose(choice[k], values))
        return Place(choice, np.array(x, dtype=float), tuple(poses))

    @cached_property
    def base_body(self) -> int:
        """Number of the base among the movable bodies; -1 for a base that does not move."""
        moved = self.placement.moved
        return next((k for k, each in enumerate(moved) if each.moves == "base"), -1)

    def mount(self, place: Place) -> Mount | None:
        """The mount of the base at a place; None without a mount."""
        k = self.base_body
        return self.bodies[k].mounts[place.choice[k]] if k >= 0 and self.bodies[k].mounts else None

    def base(self, place: Place) -> Array:
        """Pose (4, 4) of the base in the world at a place."""
        return place.poses[self.base_body] if self.base_body >= 0 else self.placement.base

    def cycles(self, place: Place) -> list[Cycle]:
        """The cycles at a place, in the frame of the base."""
        base, offsets = self.base(place), self._offsets(place)
        return [cycle_at(each.cycle, base, *offsets) for each in self.placement.cycles]

    def stops(self, place: Place) -> list[dict[str, Array]]:
        """Poses (4, 4) of the bodies of the stops in the frame of the base.

        The list has one mapping per cycle, by the names of its stops and of its start.
        """
        T_base_world, (offsets, _) = inverted(self.base(place)), self._offsets(place)
        names = [
            (START, *(stop.name for stop in each.cycle.stops)) for each in self.placement.cycles
        ]
        return [
            {
                name: composed(T_base_world, offsets[name]) if name in offsets else T_base_world
                for name in each
            }
            for each in names
        ]

    def _offsets(self, place: Place) -> tuple[Offsets, Offsets]:
        """Offsets of stops and of obstacles in the world."""
        stops, obstacles = dict[str, Array](), dict[str, Array]()
        for moved, pose in zip(self.placement.moved, place.poses, strict=True):
            if isinstance(moved.moves, Group):
                stops |= dict.fromkeys(moved.moves.stops, pose)
                obstacles |= dict.fromkeys(moved.moves.obstacles, pose)
        return stops, obstacles

    def map(self) -> list[Place]:
        """The places of the map.

        Raises:
            InvalidProblem: the resolution gives too many places.
        """
        size = self._size(self._counts)
        if self.placement.resolution is not None and size > MAP.most_points:
            raise InvalidProblem(
                "resolution",
                f"This resolution gives {size} places, but at most {MAP.most_points} are "
                "possible: give a coarser one, or a smaller region.",
            )
        values = [axis.values(count) for axis, count in zip(self.axes, self._counts, strict=True)]
        return [
            self.place(choice, np.array(x)) for choice in self.choices for x in product(*values)
        ]

    @property
    def resolution(self) -> float | None:
        """Largest distance between neighbouring places of the map [m]; None of listed places."""
        scale = np.array([axis.scale for axis in self.axes])
        return float((self.spacing / scale).max()) if self.axes else None

    @cached_property
    def spacing(self) -> Array:
        """Distances between neighbouring places of the map along the axes, shape (n,) [m, rad]."""
        pairs = zip(self.axes, self._counts, strict=True)
        return np.array([axis.distance(count) for axis, count in pairs])

    def _size(self, counts: Sequence[int]) -> int:
        return len(self.choices) * prod(counts)

    @cached_property
    def _counts(self) -> list[int]:
        """Number of values of every axis on the map."""
        given = self.placement.resolution
        if given is not None:
            return [axis.count(given) for axis in self.axes]
        return most_counts(self.axes, len(self.choices))


def _body(placement: Placement, k: int) -> MovableBody:
    moved = placement.moved[k]
    is_base = moved.moves == "base"
    given = placement.base if is_base else np.eye(4)
    if isinstance(moved.region, Places):
        others = [pose for pose in moved.region.poses if not np.array_equal(pose, given)]
        return MovableBody(None, (given, *others), np.zeros(4), np.zeros(3))
    if isinstance(moved.moves, Group):
        return MovableBody((np.eye(3),), None, np.zeros(4), _pivot(placement, moved.moves))
    R = given[:3, :3]
    yaw, mount = yaw_of(R), mount_of(R)
    tilts: dict[Mount | None, Array] = {mount: about_z(-yaw) @ R}
    mounts = moved.region.mounts
    if mounts is not None and mount not in mounts:
        raise InvalidProblem(
            placement.field(k, "region.mounts"),
            f"The nominal base is not in the region: its mount is {mount or 'none of them'}; "
            "name it, too, or give another `base`.",
        )
    for name in mounts or ():
        if name != mount:
            tilts[name] = TILTS[name]
    nominal = np.array([*given[:3, 3], yaw])
    return MovableBody(tuple(tilts.values()), None, nominal, np.zeros(3), tuple(tilts))


def _axes(placement: Placement, k: int, region: Region, body: MovableBody) -> Iterator[Axis]:
    for name, nominal in zip(COORDINATES, body.nominal.tolist(), strict=True):
        given = region.range_of(name)
        if given is None:
            continue
        low, high = given
        if name == "yaw":
            # the equivalent yaw nearest to the middle of the range
            turn = 2 * np.pi
            nominal += turn * np.round(((low + high) / 2 - nominal) / turn)
        if not low - MAP.inside <= nominal <= high + MAP.inside:
            raise InvalidProblem(
                placement.field(k, f"region.{name}"),
                f"The nominal place is not in the region: its {name} is {nominal:.6g}, and the "
                f"range is from {low:g} to {high:g}. Widen the range, or give another `base`.",
            )
        nominal = float(np.clip(nominal, low, high))
        body.nominal[COORDINATES.index(name)] = nominal
        if high - low > MAP.fixed:
            yield Axis(k, name, low, high, nominal)


def _pivot(placement: Placement, group: Group) -> Array:
    """Mean position (3,) [m] of a group's stops; without stops, of its obstacles."""
    cycles = [each.cycle for each in placement.cycles]
    targets = [(START, cycle.start) for cycle in cycles]
    targets += [(stop.name, stop.target) for cycle in cycles for stop in cycle.stops]
    at: Sequence[Array] = [
        each.T[:3, 3] if isinstance(each, Pose) else each.position
        for name, target in targets
        if name in group.stops
        for each in members(target)
        if isinstance(each, Pose | ConeOrientedPose)
    ]
    at = at or [
        each.T_base_shape[:3, 3]
        for cycle in cycles
        for each in cycle.arm.scene.obstacles
        if each.name in group.obstacles
    ]
    return np.asarray(np.mean(at, axis=0))
