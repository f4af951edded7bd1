"""A request for the placement of least energy. Validated on construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.placement.region import Group, Moved, Region
from joulepath.optimizer.problem.arrays import placement
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.problem.targets import Target, members
from joulepath.optimizer.problem.uncoupled import check_uncoupled
from joulepath.optimizer.result.energy import Objective


@dataclass(frozen=True)
class PlacementRanges:
    """Ranges of placements."""

    max_cycles: int = 8
    """Most cycles."""
    max_moved: int = 4
    """Most bodies that move, the base among them."""
    finest: float = 1e-3
    """Finest resolution [m]."""
    coarsest: float = 2.0
    """Coarsest resolution [m], beyond the reach of most arms."""
    max_weight: float = 1e6
    """Greatest weight of a cycle."""
    upright: float = 1e-6
    """Deviation of the direction of gravity from the world's -z below which mounts are known."""


PLACEMENT_RANGES = PlacementRanges()


@dataclass(frozen=True)
class WeightedCycle:
    """A cycle, and its frequency among the cycles of a placement.

    Attributes:
        cycle: the cycle, its poses in the world.
        weight: number of runs per unit of time; the unit is the same for all cycles.

    Raises:
        InvalidProblem: the weight is not positive.
    """

    cycle: Cycle
    weight: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        check_number("weight", self.weight, most=PLACEMENT_RANGES.max_weight, positive=True)


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A request for the place of least energy for cycles, of the robot or of groups around it.

    Attributes:
        cycles: cycles of one robot. Poses, obstacles, directions and gravity are in the world.
        moved: the movable bodies, with the regions of their places.
        base: nominal pose of the robot base in the world, shape (4, 4).
        resolution: largest distance between neighbouring places of the map [m]; None for a map of
            at most `MapSettings.points` places.
        deadline: limit of the wall time [s].

    Raises:
        InvalidProblem: a field is malformed, or the fields do not fit together.
    """

    cycles: Sequence[WeightedCycle]
    moved: Sequence[Moved]
    base: Array = field(default_factory=lambda: np.eye(4))
    resolution: float | None = None
    deadline: float = 120.0

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "cycles", tuple(self.cycles))
        object.__setattr__(self, "moved", tuple(self.moved))
        object.__setattr__(self, "base", placement(self.base, "base"))
        if not 1 <= len(self.cycles) <= PLACEMENT_RANGES.max_cycles:
            raise InvalidProblem(
                "cycles", f"A placement has 1 to {PLACEMENT_RANGES.max_cycles} cycles."
            )
        robot = "cycle.robot" if len(self.cycles) == 1 else "cycles.0.cycle.robot"
        check_uncoupled(self.cycles[0].cycle.arm.robot, robot, "There are no placements")
        if not 1 <= len(self.moved) <= PLACEMENT_RANGES.max_moved:
            raise InvalidProblem(
                "moves", f"A placement moves 1 to {PLACEMENT_RANGES.max_moved} bodies."
            )
        least, most = PLACEMENT_RANGES.finest, PLACEMENT_RANGES.coarsest
        check_number("resolution", self.resolution, "metres", least=least, most=most, optional=True)
        check_number("deadline", self.deadline, "seconds", positive=True)
        self._check_cycles()
        self._check_moved()
        for k, each in enumerate(self.moved):
            if isinstance(each.moves, Group):
                self._check_group(k, each.moves)

    def field(self, k: int, name: str) -> str:
        """Field of a request for the value `name` of the movable body `k`."""
        return name if len(self.moved) == 1 else f"moves.{k}.{name}"

    @property
    def objective(self) -> Objective:
        """The minimised energy."""
        return self.cycles[0].cycle.objective

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity in the world, shape (3,) [m/s²]."""
        return self.cycles[0].cycle.arm.gravity

    @property
    def is_upright(self) -> bool:
        """Whether gravity points along the world's -z axis."""
        strength = float(np.linalg.norm(self.gravity))
        return bool(self.gravity[2] <= -(1 - PLACEMENT_RANGES.upright) * strength < 0)

    def _check_cycles(self) -> None:
        first = self.cycles[0].cycle
        for k, each in enumerate(self.cycles):
            cycle = each.cycle
            if cycle.arm.robot is not first.arm.robot:
                raise InvalidProblem(
                    f"cycles.{k}.cycle.robot", "All cycles of a placement are of one robot."
                )
            if cycle.objective != first.objective:
                raise InvalidProblem(
                    f"cycles.{k}.cycle.objective", "All cycles of a placement have one objective."
                )
            if not np.array_equal(cycle.arm.gravity, first.arm.gravity):
                raise InvalidProblem(
                    f"cycles.{k}.cycle.gravity",
                    "Gravity is that of the world, the same in all cycles of a placement.",
                )

    def _check_moved(self) -> None:
        taken: dict[tuple[str, str], int] = {}
        for k, each in enumerate(self.moved):
            names = [("the base", "")]
            if isinstance(each.moves, Group):
                names = [
                    *(("stop", name) for name in each.moves.stops),
                    *(("obstacle", name) for name in each.moves.obstacles),
                ]
            for name in names:
                if name in taken:
                    raise InvalidProblem(
                        f"moves.{k}",
                        f"{' '.join(name).strip()} moves already by moves.{taken[name]}: name "
                        "what moves once.",
                    )
                taken[name] = k
            mounts = isinstance(each.region, Region) and each.region.mounts is not None
            if mounts and not self.is_upright:
                raise InvalidProblem(
                    self.field(k, "region.mounts"),
                    "Mounts are defined only if gravity points along the world's -z axis: turn "
                    "the world, or leave region.mounts out.",
                )

    def _check_group(self, k: int, group: Group) -> None:
        cycles = [each.cycle for each in self.cycles]
        targets = [(START, cycle.start) for cycle in cycles]
        targets += [(stop.name, stop.target) for cycle in cycles for stop in cycle.stops]
        known = {"stops": {name for name, _ in targets}}
        known["obstacles"] = {name for cycle in cycles for name in cycle.arm.scene.names}
        for kind, names in known.items():
            unknown = [name for name in getattr(group, kind) if name not in names]
            if unknown:
                raise InvalidProblem(
                    self.field(k, f"moves.{kind}"),
                    f"No cycle has one named {unknown[0]!r} among its {kind}.",
                )
        for name, target in targets:
            if name in group.stops and _has_joint_positions(target):
                raise InvalidProblem(
                    self.field(k, "moves.stops"),
                    f"{name!r} is given by joint positions, which do not move: give its pose, or "
                    "leave it out of the group.",
                )


def _has_joint_positions(target: Target) -> bool:
    return any(not isinstance(each, Pose | ConeOrientedPose) for each in members(target))
