"""ruckig: time-optimal motions within limits on speed, acceleration and jerk."""

from __future__ import annotations

import numpy as np
import ruckig

from benchmarks.motion import Motion
from joulepath.models.robot import Array, Robot

STEP = 1e-6
"""Step of the finite differences from acceleration to jerk [s]."""


class RuckigMotion:
    """Phases of constant jerk."""

    def __init__(self, trajectory: ruckig.Trajectory) -> None:
        self.trajectory = trajectory

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.trajectory.duration)

    def sample(self, t: Array) -> tuple[Array, Array, Array, Array | None]:
        """See `Motion.sample`."""
        states = np.array([self.trajectory.at_time(instant) for instant in t.tolist()])
        before = np.array(
            [self.trajectory.at_time(max(instant - STEP, 0.0))[2] for instant in t.tolist()]
        )
        jerk = (states[:, 2] - before) / STEP
        return states[:, 0], states[:, 1], states[:, 2], jerk


class RuckigFastest:
    """Least time, without limits on torque and without energy."""

    title = "ruckig, time-optimal"
    packages: tuple[str, ...] = ("ruckig",)
    what = (
        "least time under limits of speed, acceleration and jerk, all joints end together; no "
        "limit on torque"
    )

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.generator = ruckig.Ruckig(robot.nq)

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """See `Planner.plan`."""
        limits = self.robot.limits
        given = ruckig.InputParameter(self.robot.nq)
        given.current_position, given.target_position = q_start.tolist(), q_goal.tolist()
        given.max_velocity, given.max_acceleration = limits.v_max.tolist(), limits.a_max.tolist()
        given.max_jerk = limits.j_max.tolist()
        found = ruckig.Trajectory(self.robot.nq)
        result = self.generator.calculate(given, found)
        return (
            RuckigMotion(found)
            if result in (ruckig.Result.Working, ruckig.Result.Finished)
            else None
        )
