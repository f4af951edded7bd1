"""toppra: the time-optimal time scaling of the straight line under limits on speed, acceleration
and torque.
"""

from __future__ import annotations

import logging

import numpy as np
import pinocchio as pin
import toppra
from toppra import algorithm, constraint

from benchmarks.motion import Motion
from joulepath.models.robot import Array, Robot

logging.getLogger("toppra").setLevel(logging.ERROR)

GRID = np.linspace(0.0, 1.0, 101)


class ToppraMotion:
    """Phases of constant acceleration along the path."""

    def __init__(self, trajectory: toppra.interpolator.AbstractGeometricPath) -> None:
        self.trajectory = trajectory

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.trajectory.duration)

    def sample(self, t: Array) -> tuple[Array, Array, Array, Array | None]:
        """See `Motion.sample`: the acceleration is discontinuous, so the jerk is unbounded."""
        q, v, a = (np.asarray(self.trajectory(t, order)) for order in range(3))
        return q, v, a, None


class ToppraFastest:
    """Least time along the straight line, without limits on jerk and without energy."""

    title = "toppra, time-optimal line"
    packages: tuple[str, ...] = ("toppra",)
    what = (
        "straight line in joint space, least time under limits of speed, acceleration and torque; "
        "no limit on jerk"
    )

    def __init__(self, robot: Robot) -> None:
        self.model = robot.model
        self.data = self.model.createData()
        limits, friction = robot.limits, robot.friction
        # largest dry friction: the Coulomb part, and the concave part at full speed
        dry = friction.torque(limits.v_max) - friction.viscous * limits.v_max
        self.constraints = [
            constraint.JointVelocityConstraint(_both(limits.v_max)),
            constraint.JointAccelerationConstraint(_both(limits.a_max)),
            constraint.JointTorqueConstraint(self._torque, _both(limits.tau_max), dry),
        ]

    def _torque(self, q: Array, v: Array, a: Array) -> Array:
        # without viscous friction, because toppra needs a torque that is affine in the acceleration
        # and in the square of the speed
        return np.asarray(pin.rnea(self.model, self.data, q, v, a))

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """See `Planner.plan`."""
        travel = q_goal - q_start
        path = toppra.SimplePath(
            np.array([0.0, 1.0]), np.array([q_start, q_goal]), np.array([travel, travel])
        )
        instance = algorithm.TOPPRA(
            self.constraints, path, gridpoints=GRID, parametrizer="ParametrizeConstAccel"
        )
        trajectory = instance.compute_trajectory(0.0, 0.0)
        return None if trajectory is None else ToppraMotion(trajectory)


def _both(limit: Array) -> Array:
    return np.stack([-limit, limit], axis=1)
