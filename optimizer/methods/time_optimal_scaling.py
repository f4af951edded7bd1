"""The time-optimal scaling of the straight line in joint space, by toppra (Pham, Pham 2018).

toppra limits speed, acceleration and torque, but not jerk. Its duration is therefore a lower bound for every motion
along the line. Its scaling says whether there is such a motion, and serves as initial guess.

toppra is imported where it is called: it imports matplotlib, and only this method needs it.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.energy.limited_torque import greatest_smooth_part, limited_parts
from optimizer.prepared_problem import PreparedProblem
from optimizer.trajectories.bspline import greville

logging.getLogger("toppra").setLevel(logging.ERROR)

GRID = np.linspace(0.0, 1.0, 31)
# fraction of toppra's duration that counts as a lower bound: its constraints hold at the grid points only
TRUST = 0.98


@dataclass(frozen=True)
class TimeOptimalScaling:
    """Fractions of the line GRID (31,) reached at `times` (31,) [s], from rest to rest."""

    times: Array

    @property
    def duration_bound(self) -> float:
        """Lower bound on the duration of every motion along the line [s]."""
        return TRUST * float(self.times[-1])

    def fractions(self, knots: Array) -> Array:
        """Control values (n,) of a spline over clamped knots of [0, 1] that follows the scaling from rest to rest."""
        values = np.interp(greville(knots) * self.times[-1], self.times, GRID)
        values[:3], values[-3:] = 0.0, 1.0
        return np.asarray(values)


def time_optimal_on_line(prepared: PreparedProblem, q_start: Array, q_goal: Array) -> TimeOptimalScaling | None:
    """The time-optimal scaling under speed, acceleration and torque limits; None if there is none.

    The limit of a motor's torque is relaxed by the greatest help of friction, so that the duration stays a lower bound.
    """
    limits, model = prepared.problem.arm.active_limits, prepared.model
    from toppra import SimplePath, algorithm, constraint  # see the top of this file

    displacement = q_goal - q_start
    if not np.abs(displacement).max() > 0:
        return TimeOptimalScaling(np.linspace(0.0, 1e-9, len(GRID)))
    data = model.createData()

    def torque(q: Array, v: Array, a: Array) -> Array:
        return limited_parts(prepared.arm, pin.rnea(model, data, q, v, a), v, a)[0]

    tau = greatest_smooth_part(prepared.arm)
    none = np.zeros(len(displacement))
    path = SimplePath(np.array([0.0, 1.0]), np.array([q_start, q_goal]), np.array([displacement, displacement]))
    constraints = [
        *_rate_constraints(tuple(limits.v_max.tolist()), tuple(limits.a_max.tolist())),
        constraint.JointTorqueConstraint(torque, np.stack([-tau, tau], axis=1), none),
    ]
    _, speed, _ = algorithm.TOPPRA(constraints, path, gridpoints=GRID).compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        return None
    steps = 2 * np.diff(GRID) / (speed[1:] + speed[:-1])
    return TimeOptimalScaling(np.concatenate([[0.0], np.cumsum(steps)]))


@lru_cache(maxsize=32)
def _rate_constraints(v_max: tuple[float, ...], a_max: tuple[float, ...]) -> tuple[Any, Any]:
    """toppra's constraints on speed and acceleration; cached, since toppra prints the limits of every new one."""
    from toppra import constraint

    v, a = np.array(v_max), np.array(a_max)
    return (
        constraint.JointVelocityConstraint(np.stack([-v, v], axis=1)),
        constraint.JointAccelerationConstraint(np.stack([-a, a], axis=1)),
    )
