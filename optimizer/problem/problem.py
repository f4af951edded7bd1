"""A request: the motion of least energy between two targets. Validated on construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.problem.targets import AnyOf, Target, members, validated
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.problem.uncoupled import check_uncoupled
from joulepath.optimizer.result.energy import Objective

MethodName = Literal["bspline", "time_scaling", "lagrange", "uniform_scaling", "polynomial_ga"]
# effort for the lower bound, in requests and inside a search
RequestedBound = Literal["normal", "tight"]
BoundEffort = Literal["plain", RequestedBound]


@dataclass(frozen=True)
class DurationRanges:
    """Ranges of durations."""

    least: float = 0.01
    """Least duration of a motion [s], also if start and goal are the same."""
    longest: float = 600.0
    """Greatest duration of a motion [s]."""
    least_period: float = 1e-4
    """Least period of samples [s]."""


DURATIONS = DurationRanges()


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A request for the motion of least energy of an arm between two targets.

    Attributes:
        arm: the arm.
        start: joint positions (nq,) [rad], a `Pose`, or an `AnyOf` of these.
        goal: like `start`, or a `ConeOrientedPose`.
        method: method of the solver; ignored with a tool path or passes.
        objective: "electrical" energy or "mechanical" work.
        duration_min: least duration [s]; None for no limit.
        duration_max: greatest duration [s]; None for no limit but the 600 s of any motion. Equal
            bounds fix the duration.
        dwell: rest at the goal; the motion is then no longer than `dwell.time`.
        tool_path: path of the TCP from start to goal, a pose or joint positions. Only branch and
            timing are free; if the tool may turn about an axis, start and goal may be a
            `ConeOrientedPose` with a free rotation about it.
        passes: joint positions (nq,) [rad] that the motion passes through in order, at free times;
            start and goal are then joint positions.
        branch: allowed branches of start and goal.
        windings: whether the goal may be a full turn of a joint away; ignored with a tool path.
        bound: "tight" for more effort on the lower bounds of candidates that could beat the answer;
            for mechanical work, on candidates that differ by full turns of the outer joints.
            "plain" for no effort beyond the bounds that the search needs.
        sample_period: period of the returned samples [s].
        deadline: wall time after which the best verified result is returned [s].

    Raises:
        InvalidProblem: the parts do not fit together; names the field.
        OutsideLimits: joint positions are out of range.
    """

    arm: Arm
    start: Target
    goal: Target
    method: MethodName = "bspline"
    objective: Objective = "electrical"
    duration_min: float | None = None
    duration_max: float | None = None
    dwell: Dwell | None = None
    tool_path: ToolPath | None = None
    passes: Sequence[Array] = ()
    branch: BranchFilter | None = None
    windings: bool = True
    bound: BoundEffort = "normal"
    sample_period: float = 0.008
    deadline: float = 10.0

    def __post_init__(self) -> None:
        check_search(self)
        for name in ("start", "goal"):
            end = validated(
                self.arm, name, getattr(self, name), free_start=self.tool_path is not None
            )
            object.__setattr__(self, name, end)
        for name in ("duration_min", "duration_max"):
            value, most = getattr(self, name), DURATIONS.longest
            check_number("duration", value, "seconds", most=most, positive=True, optional=True)
        if (
            self.duration_min is not None
            and self.duration_max is not None
            and self.duration_min > self.duration_max
        ):
            raise InvalidProblem("duration", "duration.min must not exceed duration.max.")
        if self.tool_path is not None:
            check_uncoupled(self.arm.robot, "tool_path", "Tool paths are not supported")
            for name in ("start", "goal"):
                end = getattr(self, name)
                if isinstance(end, AnyOf):
                    raise InvalidProblem(
                        name, f"With a path, {name} must be one pose or joint positions."
                    )
                if isinstance(end, ConeOrientedPose):
                    self.tool_path.check_free(name, end)
            self.tool_path.check_speed(self.arm.tcp_speed)
        passed = tuple(validated(self.arm, f"passes.{k}", q) for k, q in enumerate(self.passes))
        object.__setattr__(self, "passes", passed)
        if passed and not all(isinstance(q, np.ndarray) for q in (self.start, self.goal, *passed)):
            raise InvalidProblem(
                "passes", "With passes, start, goal and passes must be joint positions."
            )
        if self.dwell is not None:
            if self.duration_min is not None and self.duration_min > self.dwell.time:
                raise InvalidProblem(
                    "duration", "The shortest duration must not exceed dwell.time."
                )
            longest = DURATIONS.longest if self.duration_max is None else self.duration_max
            object.__setattr__(self, "duration_max", min(longest, self.dwell.time))
        if self.objective == "mechanical" and self.duration_max is None:
            raise InvalidProblem(
                "duration",
                "The mechanical objective has no best duration of its own: give a duration or a "
                "duration.max.",
            )

    @property
    def has_fixed_duration(self) -> bool:
        """Whether only one duration is allowed."""
        return self.duration_min is not None and self.duration_min == self.duration_max

    @property
    def may_rest(self) -> bool:
        """Whether the method's motions may rest at their ends."""
        return self.method == "bspline" and self.tool_path is None and not self.passes


def narrowed(problem: Problem, start: int, goal: int) -> Problem:
    """The problem with a single start and goal: those of the given indices."""
    return replace(problem, start=members(problem.start)[start], goal=members(problem.goal)[goal])


def check_search(asked: Any) -> None:
    """Check the choices, the sample period and the deadline of a problem or a cycle.

    Raises:
        InvalidProblem: one is unknown or out of range; names the field.
    """
    check_fields(asked)
    check_number("sample_period", asked.sample_period, "seconds", least=DURATIONS.least_period)
    check_number("deadline", asked.deadline, "seconds", positive=True)
