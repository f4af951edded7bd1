"""A cycle: stops visited by the arm one after another, again and again. Validated on
construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.dwell import Dwell, Hold, check_holding
from joulepath.optimizer.problem.free_order import FreeOrder, check_order
from joulepath.optimizer.problem.names import check_name, first_repeated
from joulepath.optimizer.problem.problem import (
    DURATIONS,
    BoundEffort,
    MethodName,
    check_search,
)
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.problem.stop_path import StopPath, at_stop
from joulepath.optimizer.problem.stops import (
    APPROACH,
    ENTRY,
    RETREAT,
    PlannedMove,
    Stop,
    moves_over,
    passing,
)
from joulepath.optimizer.problem.targets import Target, validated_in_cycle
from joulepath.optimizer.problem.uncoupled import check_uncoupled
from joulepath.optimizer.result.energy import Objective


@dataclass(frozen=True)
class CycleRanges:
    """Ranges of cycles."""

    max_stops: int = 256
    """Most stops of a cycle."""
    max_passes: int = 12
    """Most stops passed by one motion; the effort of its nonlinear program grows more than
    quadratically with their number."""
    longest: float = 36_000.0
    """Longest duration of a cycle [s]."""


CYCLE_RANGES = CycleRanges()

START = "start"
"""Name of the first configuration of a cycle, and of the last one of a closed cycle."""


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A request for the cycle of least energy from `start` through all `stops`.

    The orientation at a stop may be free in part; at the start it is given in full.

    Attributes:
        arm: arm with the payload carried from the start on.
        start: target at the start.
        stops: stops, in their order unless `order` is given.
        closed: whether the cycle ends in the configuration of its start, full turns included.
        duration_min: least duration with dwells and waits [s]; None for no limit. Time left over is
            waited out.
        duration_max: greatest duration with dwells and waits [s]; None for no limit.
        order: free order of the stops; None for the given order.
        branch: allowed branches at the start.
        method: method of the motions.
        objective: "electrical" energy, or "mechanical" work of all moves. Slower moves do less
            work, so the latter needs a `duration_max`; rests do no work.
        windings: whether every full turn of a configuration counts; otherwise only the
            configuration nearest to the middle of the joint ranges.
        hold: how the arm is held at rest, as in `Dwell`.
        brake_delay: see `Dwell` [s].
        brake_power: see `Dwell` [W].
        wait: stop at which the arm waits, or `start`; None for the cheapest place.
        rests_at_passes: whether the arm also rests at the stops it would pass through.
        with_baselines: whether to search for baselines.
        unsolved_excess: share of the bound by which unsolved electrical moves weigh more than it.
            Above 0, fewer of them are solved, and the answer is only likely the best.
        bound: effort on the lower bounds of single moves, as in `Problem`; that of the cycle does
            not depend on them.
        sample_period: period of the samples [s].
        deadline: limit of the wall time [s].

    Raises:
        InvalidProblem: a field is malformed.
        OutsideLimits: joint positions are out of range.
    """

    arm: Arm
    start: Target
    stops: Sequence[Stop]
    closed: bool = True
    duration_min: float | None = None
    duration_max: float | None = None
    order: FreeOrder | None = None
    branch: BranchFilter | None = None
    method: MethodName = "bspline"
    objective: Objective = "electrical"
    windings: bool = True
    hold: Hold = "motors"
    brake_delay: float = 0.0
    brake_power: float | None = None
    wait: str | None = None
    rests_at_passes: bool = False
    with_baselines: bool = True
    unsolved_excess: float = 0.0
    bound: BoundEffort = "normal"
    sample_period: float = 0.008
    deadline: float = 60.0

    def __post_init__(self) -> None:
        check_search(self)
        check_number("unsolved_excess", self.unsolved_excess)
        object.__setattr__(self, "stops", tuple(self.stops))
        if not 1 <= len(self.stops) <= CYCLE_RANGES.max_stops:
            raise InvalidProblem("stops", f"A cycle must have 1 to {CYCLE_RANGES.max_stops} stops.")
        self._check_names()
        object.__setattr__(self, "start", validated_in_cycle(self.arm, "start", self.start))
        checked = tuple(
            replace(stop, target=validated_in_cycle(self.arm, f"stops.{k}.target", stop.target))
            for k, stop in enumerate(self.stops)
        )
        object.__setattr__(self, "stops", checked)
        for k, stop in enumerate(self.stops):
            check_number(f"stops.{k}.dwell", stop.dwell, "seconds", most=DURATIONS.longest)
            self._check_limits(k, stop)
            for name in ("approach", "retreat", "path"):
                if getattr(stop, name) is not None:
                    check_uncoupled(
                        self.arm.robot, f"stops.{k}.{name}", "Tool paths are not supported"
                    )
            if stop.path is not None:
                self._check_path(k, stop, stop.path)
            if stop.via:
                self._check_passed(k, stop)
            self.arm.check_rating(
                f"stops.{k}.payload.mass", 0.0 if stop.payload is None else stop.payload.mass
            )
        self.arm.check_rating("payload.mass", self.arm.payload.mass)
        if self.order is not None:
            check_order(self.order, self.stops, self.arm.payload)
        self._check_passes()
        check_holding("hold", self.hold, self.brake_delay, self.brake_power)
        self._check_wait()
        self._check_duration()

    def _check_names(self) -> None:
        for k, stop in enumerate(self.stops):
            check_name(f"stops.{k}.name", stop.name)
            unknown = [name for name in stop.obstacles_ignored if name not in self.arm.scene.names]
            if unknown:
                raise InvalidProblem(
                    f"stops.{k}.obstacles_ignored",
                    f"There is no obstacle named {unknown[0]!r} in scene.obstacles.",
                )
        places = [
            (0, START),
            *((k, name) for k, stop in enumerate(self.stops) for name in stop.places),
        ]
        repeated = first_repeated([name for _, name in places])
        if repeated is not None:
            raise InvalidProblem(
                f"stops.{places[repeated][0]}.name",
                f"Give each stop its own name. {START!r} is reserved for the start, a stop's "
                f"name with {APPROACH} or {RETREAT} for the outer end of its line, and with "
                f"{ENTRY} for the start of its path.",
            )

    def _check_path(self, k: int, stop: Stop, path: StopPath) -> None:
        try:
            path.check_ends(stop.target)
        except InvalidProblem as error:
            raise InvalidProblem(f"stops.{k}.{error.field}", str(error)) from None
        most = self.arm.no_faster_than(stop.tcp_speed).no_faster_than(path.speed).tcp_speed
        try:
            path.path.check_speed(most)
        except InvalidProblem as error:
            raise at_stop(k, error) from None

    def _check_passed(self, k: int, stop: Stop) -> None:
        given = {
            "dwell": stop.dwell > 0,
            "payload": stop.payload is not None,
            "path": stop.path is not None,
            "approach": stop.approach is not None,
            "retreat": stop.retreat is not None,
            "obstacles_ignored": bool(stop.obstacles_ignored),
        }
        for field in (field for field, there in given.items() if there):
            raise InvalidProblem(
                f"stops.{k}.{field}",
                f"The arm passes through stop {stop.name!r} without a rest: leave out its {field}, "
                "or set its via to "
                "false.",
            )
        if self.objective == "mechanical":
            raise InvalidProblem(
                f"stops.{k}.via",
                "A cycle of least mechanical work rests at every stop: set via to false.",
            )
        if self.order is not None:
            raise InvalidProblem(
                f"stops.{k}.via",
                "With a free order the arm rests at every stop: give the order, or set via to "
                "false.",
            )
        if not self.closed and k == len(self.stops) - 1:
            raise InvalidProblem(
                f"stops.{k}.via",
                "A cycle that is not closed ends at rest at its last stop: set its via to false.",
            )

    def _check_passes(self) -> None:
        passed = 0
        for k, stop in enumerate(self.stops):
            passed = passed + 1 if stop.via else 0
            if passed > CYCLE_RANGES.max_passes:
                raise InvalidProblem(
                    f"stops.{k}.via",
                    f"The arm passes through at most {CYCLE_RANGES.max_passes} stops between two "
                    "rests: set "
                    "via to false here.",
                )

    def _check_limits(self, k: int, stop: Stop) -> None:
        given = {name: getattr(stop, name) for name in ("limits", "tcp_speed", "elbow_speed")}
        try:
            replace(self.arm, **{name: value for name, value in given.items() if value is not None})
        except InvalidProblem as error:
            raise InvalidProblem(f"stops.{k}.{error.field}", f"stops.{k}.{error}") from None

    def _check_wait(self) -> None:
        if self.wait is not None and self.wait not in (move.goal for move in self.moves):
            raise InvalidProblem(
                "wait", f"No move ends at a place named {self.wait!r}: give the name of a stop."
            )

    def _check_duration(self) -> None:
        for value in (self.duration_min, self.duration_max):
            longest = CYCLE_RANGES.longest
            check_number("time", value, "seconds", most=longest, positive=True, optional=True)
        if (
            self.duration_min is not None
            and self.duration_max is not None
            and self.duration_min > self.duration_max
        ):
            raise InvalidProblem("time", "time.min must not exceed time.max.")
        if self.objective == "mechanical" and self.duration_max is None:
            raise InvalidProblem(
                "time",
                "The mechanical objective has no best duration of its own: give the cycle a time "
                "or a time.max.",
            )

    @property
    def dwell_time(self) -> float:
        """Duration of all dwells [s]."""
        return sum(stop.dwell for stop in self.stops)

    @property
    def longest_move(self) -> float:
        """Longest duration of a move [s]."""
        most = np.inf if self.duration_max is None else self.duration_max - self.dwell_time
        return float(np.clip(most, DURATIONS.least, DURATIONS.longest))

    def dwell_of(self, length: float) -> Dwell:
        """A dwell of `length` [s] after a motion of zero duration."""
        return Dwell(length, self.hold, self.brake_delay, self.brake_power)

    @cached_property
    def arms(self) -> list[Arm]:
        """Arm with its payload on the way to every stop and after the last one; one arm per
        payload.
        """
        arms = [self.arm]
        for stop in self.stops:
            payload = arms[-1].payload if stop.payload is None else stop.payload
            same = (arm for arm in arms if arm.payload.is_same_body(payload))
            arms.append(next(same, None) or replace(self.arm, payload=payload))
        return arms

    @cached_property
    def moves(self) -> list[PlannedMove]:
        """Moves of the cycle in order, including those along lines and paths."""
        moves, place, passed = list[PlannedMove](), START, list[Stop]()
        for stop, before, after in zip(self.stops, self.arms, self.arms[1:], strict=False):
            if stop.via:
                passed.append(stop)
                continue
            first, *others = moves_over(stop, place, before, after)
            moves += [passing(first, passed), *others]
            place, passed = moves[-1].goal, []
        if self.closed:
            moves.append(passing(PlannedMove(place, START, self.arms[-1], self.arms[-1]), passed))
        return [part for move in moves for part in move.parts] if self.rests_at_passes else moves

    @cached_property
    def has_passes(self) -> bool:
        """Whether the arm passes through some stop without a rest."""
        return any(move.through for move in self.moves)

    def may_wait_after(self, move: PlannedMove) -> bool:
        """Whether the arm may wait after a move: not at a stop it would pass through."""
        at_pass = any(stop.via and stop.name == move.goal for stop in self.stops)
        return self.wait in (None, move.goal) and not at_pass

    @property
    def has_free_duration(self) -> bool:
        """Whether the duration of the cycle is not limited."""
        return self.duration_min is None and self.duration_max is None

    def clamped_duration(self, duration: float) -> float:
        """The allowed duration [s] nearest to the given one."""
        most = np.inf if self.duration_max is None else self.duration_max
        return min(max(duration, self.duration_min or 0.0), most)
