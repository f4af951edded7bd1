"""Smallest speed of the TCP on its path, except for a ramp at either end."""

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


@dataclass(frozen=True)
class LeastSpeedSettings:
    """Resolution of the distance along the course, and the speed aimed at."""

    measured_points: int = 32
    """Smallest number of points on each piece of the course between which its length is
    measured.
    """
    measured_step: float = 0.002
    """Largest distance between these points [m]."""
    free_ramp: float = 0.5
    """Share of a ramp before the speed aimed at begins to rise."""


SETTINGS = LeastSpeedSettings()


@dataclass(frozen=True, eq=False)
class LeastSpeed:
    """Speed of the TCP relative to the least one.

    `speed` gives the ratio. `travelled` (k,) [m] is the distance of the TCP at fractions `at` (k,)
    of its course. Within `ramp` [m] of either end, the speed may be below `least` [m/s].
    """

    arm: Arm
    speed: PathConstraints
    at: Array
    travelled: Array
    least: float
    ramp: float

    @classmethod
    def of(cls, arm: Arm, course: ToolCourse) -> LeastSpeed | None:
        """Least speed on a course; None if the path has none."""
        path = course.path
        if path.least_speed is None:
            return None
        point = PointSpeedConstraint(
            "path_speed", arm.robot.nq, T_last_tcp(arm)[None, :3, 3], path.least_speed
        )
        at, travelled = course.measured(SETTINGS.measured_points, SETTINGS.measured_step)
        speed = PathConstraints(joint_placements(arm.robot.model), [point])
        return cls(arm, speed, at, travelled, path.least_speed, path.ramp)

    def aimed_at(self, fraction: Array) -> tuple[Array, Array]:
        """Share (k,) of the least speed that a motion should have at fractions (k,) of the course,
        and its slope.

        It rises smoothly from 0 to 1 within the ramps, and is 1 between them.
        """
        cell = np.clip(np.searchsorted(self.at, fraction, side="right") - 1, 0, len(self.at) - 2)
        slope = np.diff(self.travelled)[cell] / np.diff(self.at)[cell]
        travelled = self.travelled[cell] + slope * (fraction - self.at[cell])
        left = self.travelled[-1] - travelled
        x = (np.minimum(travelled, left) / self.ramp - SETTINGS.free_ramp) / (
            1 - SETTINGS.free_ramp
        )
        inside = np.clip(x, 0.0, 1.0)
        by_distance = (
            6
            * (inside - inside**2)
            / (self.ramp * (1 - SETTINGS.free_ramp))
            * np.where(travelled < left, 1.0, -1.0)
        )
        return inside**2 * (3 - 2 * inside), by_distance * slope

    def linearised(self, q: Array, v: Array) -> ConstraintRatios:
        """Speed relative to the least one (n, 1), and its gradients."""
        return self.speed.linearised(q, v)

    def out_of_reach(self, q: Array, tangent: Array, v_max: Array) -> tuple[float, float] | None:
        """Fraction of the course with the lowest speed that the joints allow, and this speed [m/s].

        Args:
            q: joint path at evenly spaced fractions, shape (n, nq) [rad].
            tangent: derivative of the joint path by the fraction, shape (n, nq) [rad].
            v_max: joint speed limits, shape (nq,) [rad/s].

        Returns:
            The fraction and the speed; None if the least speed is possible everywhere between the
            ramps.
        """
        allowed = self.speed.ratios(q, tangent)[:, 0] / (np.abs(tangent) / v_max).max(axis=1)
        at = np.linspace(0.0, 1.0, len(q))
        lacking = np.where(self.aimed_at(at)[0] < 1, np.inf, allowed)
        worst = int(lacking.argmin())
        return (
            (float(at[worst]), float(lacking[worst]) * self.least) if lacking[worst] < 1 else None
        )

    def reached(self, q: Array, v: Array) -> float:
        """Lowest speed between the ramps relative to the least one, from consecutive samples q
        [rad], v [rad/s] (n, nq).
        """
        travelled = np.cumsum(
            np.linalg.norm(np.diff(tcp_pose(self.arm, q)[:, :3, 3], axis=0), axis=1)
        )
        travelled = np.append(0.0, travelled)
        between = (travelled >= self.ramp) & (travelled <= travelled[-1] - self.ramp)
        return float(self.speed.ratios(q, v)[between].min(initial=np.inf))
