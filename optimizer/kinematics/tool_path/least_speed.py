"""The least speed of the TCP on its path, but for a ramp at either end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import (
    ConstraintRatios,
    PathConstraints,
    PointSpeedConstraint,
)
from joulepath.optimizer.kinematics.tcp import T_last_tcp, tcp_pose
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.problem.arm import Arm

# points on each piece of the course between which its length is measured, and the way between two
# [m] at most
MEASURED, STEP = 32, 0.002
# share of a ramp at which the speed that an optimiser aims at begins to rise
FREE = 0.5


@dataclass(frozen=True, eq=False)
class LeastSpeed:
    """The speed over the least one, by `speed`; and the way (k,) [m] that the TCP has gone at
    fractions `at` (k,) of its course. The speed may be below the `least` [m/s] within `ramp` [m] of
    either end."""

    arm: Arm
    speed: PathConstraints
    at: Array
    gone: Array
    least: float
    ramp: float

    @classmethod
    def of(cls, arm: Arm, course: ToolCourse) -> LeastSpeed | None:
        """The least speed on a course; None if it has none."""
        path = course.path
        if path.least_speed is None:
            return None
        point = PointSpeedConstraint(
            "path_speed", arm.robot.nq, T_last_tcp(arm)[None, :3, 3], path.least_speed
        )
        at, gone = course.measured(MEASURED, STEP)
        speed = PathConstraints(joint_placements(arm.robot.model), [point])
        return cls(arm, speed, at, gone, path.least_speed, path.ramp)

    def aimed_at(self, fraction: Array) -> tuple[Array, Array]:
        """The share of the least speed (k,) that a motion is to have at fractions (k,) of the
        course, and its slope.

        It rises smoothly from 0 to 1 within the ramps, and is 1 between them.
        """
        cell = np.clip(np.searchsorted(self.at, fraction, side="right") - 1, 0, len(self.at) - 2)
        slope = np.diff(self.gone)[cell] / np.diff(self.at)[cell]
        gone = self.gone[cell] + slope * (fraction - self.at[cell])
        left = self.gone[-1] - gone
        x = (np.minimum(gone, left) / self.ramp - FREE) / (1 - FREE)
        inside = np.clip(x, 0.0, 1.0)
        by_way = (
            6 * (inside - inside**2) / (self.ramp * (1 - FREE)) * np.where(gone < left, 1.0, -1.0)
        )
        return inside**2 * (3 - 2 * inside), by_way * slope

    def linearised(self, q: Array, v: Array) -> ConstraintRatios:
        """The speed over the least one (n, 1), and its gradients."""
        return self.speed.linearised(q, v)

    def out_of_reach(self, q: Array, tangent: Array, v_max: Array) -> tuple[float, float] | None:
        """The fraction of the course at which the joints' speed limits v_max (nq,) [rad/s] allow
        the TCP least, and the speed [m/s] there; None if it may have the least speed everywhere
        between the ramps.

        q, tangent (n, nq) are the joints' path and its derivative at even fractions.
        """
        allowed = self.speed.ratios(q, tangent)[:, 0] / (np.abs(tangent) / v_max).max(axis=1)
        at = np.linspace(0.0, 1.0, len(q))
        lacking = np.where(self.aimed_at(at)[0] < 1, np.inf, allowed)
        worst = int(lacking.argmin())
        return (
            (float(at[worst]), float(lacking[worst]) * self.least) if lacking[worst] < 1 else None
        )

    def reached(self, q: Array, v: Array) -> float:
        """The least speed over the one that is asked for, of samples q [rad], v [rad/s] (n, nq) in
        their order.
        """
        gone = np.cumsum(np.linalg.norm(np.diff(tcp_pose(self.arm, q)[:, :3, 3], axis=0), axis=1))
        gone = np.append(0.0, gone)
        between = (gone >= self.ramp) & (gone <= gone[-1] - self.ramp)
        return float(self.speed.ratios(q, v)[between].min(initial=np.inf))
