"""A cycle of work: stops that the arm visits one after the other, again and again. Validated on
construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem, OutsideLimits
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.dwell import Dwell, Hold
from joulepath.optimizer.problem.free_order import FreeOrder, check_order
from joulepath.optimizer.problem.names import check_name, first_repeated
from joulepath.optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION, MethodName
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
from joulepath.optimizer.problem.targets import AnyOf, Target, validated
from joulepath.optimizer.result.energy import Objective

MOST_STOPS = 256
# stops that one motion passes through: the effort of its nonlinear program grows with their square
# and more
MOST_PASSES = 12
# longest duration of a cycle [s]
LONGEST_ROUND = 36_000.0
# name of the configuration from which the cycle starts, and of a closed cycle's end
START = "start"


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A request for the cycle of least energy: from `start` over all `stops`, in their order or a
    free one.

    `start` is a target like those of the stops, `branch` restricts its branches; `arm` carries its
    payload from the start to the first stop that changes it. A `closed` round ends in the
    configuration in which it started, full turns included. `duration_min` and `duration_max` [s]
    bound the duration of the cycle, dwells and waiting included: time that is left over is waited
    out. With `windings` every full-turn alternative of a configuration counts; else the one nearest
    to the middle of the joints' ranges. `hold`, `brake_delay` [s] and `brake_power` [W] say how the
    arm dwells and waits, as in `Dwell`; it waits at `wait`, a stop or the start (None: where that
    costs least).

    The `objective` "mechanical" is the work of all moves. Slower moves do less, so it needs a
    `duration_max`; rests do none.

    With `stopping` the arm rests at the stops that it would pass through, too: what passing is
    compared with. Where it is not `compared`, other ways to go round are not looked for. A `rough`
    cycle is likely one of the best: electrical moves that are not solved weigh more than their
    bounds, so that fewer of them are.

    The orientation at a stop may be free in part, at the start it is given in full.

    Raises InvalidProblem or OutsideLimits, with the field named.
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
    stopping: bool = False
    compared: bool = True
    rough: bool = False
    sample_period: float = 0.008
    deadline: float = 60.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "stops", tuple(self.stops))
        if not 1 <= len(self.stops) <= MOST_STOPS:
            raise InvalidProblem("stops", f"A cycle must have 1 to {MOST_STOPS} stops.")
        self._check_names()
        object.__setattr__(self, "start", _checked_target(self.arm, "start", self.start))
        checked = tuple(
            replace(stop, target=_checked_target(self.arm, f"stops.{k}.target", stop.target))
            for k, stop in enumerate(self.stops)
        )
        object.__setattr__(self, "stops", checked)
        for k, stop in enumerate(self.stops):
            if not 0 <= stop.dwell <= LONGEST_DURATION:
                raise InvalidProblem(
                    f"stops.{k}.dwell", f"dwell must be from 0 to {LONGEST_DURATION:g} s."
                )
            self._check_limits(k, stop)
            if stop.path is not None:
                self._check_path(k, stop, stop.path)
            if stop.via:
                self._check_passed(k, stop)
            self.arm.check_rating(
                f"stops.{k}.payload.mass", 0.0 if stop.payload is None else stop.payload.mass
            )
        self.arm.check_rating("payload.mass", self.arm.payload.mass)
        for name in ("sample_period", "deadline"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidProblem(name, f"{name} must be a positive number of seconds.")
        if self.order is not None:
            check_order(self.order, self.stops, self.arm.payload)
        self._check_passes()
        self._check_holding()
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
                f"Give each stop a name of its own. {START!r} is the start's, a stop's name with "
                f"{APPROACH} or "
                f"{RETREAT} is that of the outer end of its line, and with {ENTRY} that of the "
                "start of its path.",
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
            if passed > MOST_PASSES:
                raise InvalidProblem(
                    f"stops.{k}.via",
                    f"The arm passes through at most {MOST_PASSES} stops between two rests: set "
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

    def _check_holding(self) -> None:
        try:
            self.waiting(1.0)
        except InvalidProblem as error:
            raise InvalidProblem(
                error.field.replace("dwell", "hold"), str(error).replace("dwell", "hold")
            ) from None

    def _check_duration(self) -> None:
        for value in (self.duration_min, self.duration_max):
            if value is not None and not 0 < value <= LONGEST_ROUND:
                raise InvalidProblem(
                    "time", f"time must be above 0 and at most {LONGEST_ROUND:g} s."
                )
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
    def dwelling(self) -> float:
        """Time [s] of all dwells."""
        return sum(stop.dwell for stop in self.stops)

    @property
    def longest_move(self) -> float:
        """Longest duration [s] of a move."""
        most = np.inf if self.duration_max is None else self.duration_max - self.dwelling
        return float(np.clip(most, LEAST_DURATION, LONGEST_DURATION))

    def waiting(self, length: float) -> Dwell:
        """A wait of `length` [s], as the wait after a motion of no duration."""
        return Dwell(length, self.hold, self.brake_delay, self.brake_power)

    @cached_property
    def arms(self) -> list[Arm]:
        """The arm with what it carries on the way to each stop, and after the last one: one arm for
        each payload.
        """
        arms, known = [self.arm], {self.arm.payload.content: self.arm}
        for stop in self.stops:
            payload = arms[-1].payload if stop.payload is None else stop.payload
            if payload.content not in known:
                known[payload.content] = replace(self.arm, payload=payload)
            arms.append(known[payload.content])
        return arms

    @cached_property
    def moves(self) -> list[PlannedMove]:
        """The moves of the cycle in their order, those along lines and paths included."""
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
        return [part for move in moves for part in move.parts] if self.stopping else moves

    @cached_property
    def passes(self) -> bool:
        """Whether the arm passes through some stop without a rest."""
        return any(move.through for move in self.moves)

    def may_wait_after(self, move: PlannedMove) -> bool:
        """Whether time that is left over may be waited out after a move: not at a stop that the arm
        passes through.
        """
        at_pass = any(stop.via and stop.name == move.goal for stop in self.stops)
        return self.wait in (None, move.goal) and not at_pass

    @property
    def any_time(self) -> bool:
        """Whether the cycle may take as long as it does."""
        return self.duration_min is None and self.duration_max is None

    def nearest_duration(self, duration: float) -> float:
        """The duration [s] within the bounds of the time that is nearest to another one."""
        most = np.inf if self.duration_max is None else self.duration_max
        return min(max(duration, self.duration_min or 0.0), most)


def _checked_target(arm: Arm, field: str, target: Target) -> Target:
    """The target, its joint positions as read-only arrays.

    Raises InvalidProblem, also for a start, or one of several targets, whose orientation is free in
    part; or OutsideLimits.
    """
    if field == START and isinstance(target, ConeOrientedPose):
        raise InvalidProblem(
            field,
            "The orientation at the start is given in full: give a quaternion, rpy or rotvec, or "
            "joint positions.",
        )
    if isinstance(target, AnyOf) and any(
        isinstance(member, ConeOrientedPose) for member in target.targets
    ):
        raise InvalidProblem(
            field,
            "Of several targets, each has its orientation in full: give a quaternion, rpy or "
            "rotvec.",
        )
    try:
        return validated(arm, "goal", target)
    except OutsideLimits as error:
        raise OutsideLimits(field, error.joint, error.value, error.lower, error.upper) from None
    except InvalidProblem as error:
        raise InvalidProblem(
            error.field.replace("goal", field, 1), str(error).replace("goal", field, 1)
        ) from None
