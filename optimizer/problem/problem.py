"""A request: the motion of least energy between two targets. Validated on construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.targets import AnyOf, Target, members, validated
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.result.energy import Objective

MethodName = Literal["bspline", "time_scaling", "lagrange", "uniform_scaling", "polynomial_ga"]
# effort for the lower bound of the answer
BoundEffort = Literal["normal", "tight"]

# bounds on every planned duration [s]; the first also holds if start and goal are the same
LEAST_DURATION = 0.01
LONGEST_DURATION = 600.0


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A request for the motion of least energy of `arm` between `start` and `goal`.

    `start` and `goal` are joint positions (nq,) [rad], a `Pose`, or an `AnyOf` of these; the goal
    may be a `ConeOrientedPose`. `duration_min` and `duration_max` [s] bound the duration. If they
    are equal, they fix it; None leaves it to the optimiser. With a `dwell` the arm waits at the
    goal until the end of the dwell, and the motion lasts no longer than the dwell.

    With a `tool_path` the TCP goes along it from `start` to `goal`, which are a pose or joint
    positions each: only the branch and the timing are free, and `method` and `windings` do not
    matter. If the tool may turn about an axis on the way, start and goal may leave the rotation
    about it free: a `ConeOrientedPose` each.

    With `passes`, joint positions (nq,) [rad], the motion passes through them in their order, at
    times that are free; then start and goal are joint positions, too, and `method` does not matter.

    `branch` restricts the inverse kinematics branches of start and goal. With `windings` the goal
    may also be a full turn of a joint away. With the `bound` "tight" more time goes into the lower
    bounds of what could still beat the answer; for mechanical work, into solving all candidates
    that differ by full turns of the outer joints. `sample_period` [s] is that of the returned
    samples. After `deadline` [s] of wall time the best verified result so far is returned.

    Raises InvalidProblem or OutsideLimits, with the field named, if the parts do not fit together.
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
        for name in ("start", "goal"):
            end = validated(self.arm, name, getattr(self, name), on_path=self.tool_path is not None)
            object.__setattr__(self, name, end)
        for name in ("duration_min", "duration_max"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InvalidProblem("duration", "duration must be a positive number of seconds.")
        if (
            self.duration_min is not None
            and self.duration_max is not None
            and self.duration_min > self.duration_max
        ):
            raise InvalidProblem("duration", "duration.min must not exceed duration.max.")
        if self.tool_path is not None:
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
            longest = (
                self.dwell.time
                if self.duration_max is None
                else min(self.duration_max, self.dwell.time)
            )
            object.__setattr__(self, "duration_max", longest)
        if self.objective == "mechanical" and self.duration_max is None:
            raise InvalidProblem(
                "duration",
                "The mechanical objective has no best duration of its own: give a duration or a "
                "duration.max.",
            )
        for name in ("sample_period", "deadline"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidProblem(name, f"{name} must be a positive number of seconds.")


def narrowed(problem: Problem, start: int, goal: int) -> Problem:
    """The same problem with only one target each: those of index `start` and `goal` among its
    own."""
    return replace(problem, start=members(problem.start)[start], goal=members(problem.goal)[goal])
