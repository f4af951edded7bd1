"""The shortest time law along the straight line in joint space, by toppra (Pham, Pham 2018).

toppra knows speed, acceleration and torque, not jerk: its law bounds the duration of every time-scaled motion from
below, says whether there is one at all, and shapes the first guess.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin
import toppra
from toppra import algorithm, constraint

from models.robot import Array
from optimizer.prepared_problem import PreparedProblem
from optimizer.trajectories.bspline import greville

logging.getLogger("toppra").setLevel(logging.ERROR)

GRID = np.linspace(0.0, 1.0, 31)
# share of toppra's duration that counts as proven: its constraints hold at the grid points only
TRUST = 0.98


@dataclass(frozen=True)
class TimeOptimalScaling:
    """Fractions of the line GRID (31,) reached at `times` (31,) [s], from rest to rest."""

    times: Array

    @property
    def duration_bound(self) -> float:
        """No time-scaled motion is shorter [s]."""
        return TRUST * float(self.times[-1])

    def fractions(self, knots: Array) -> Array:
        """Control values (n,) of a spline over clamped knots of [0, 1] that follows the law, at rest at both ends."""
        values = np.interp(greville(knots) * self.times[-1], self.times, GRID)
        values[:3], values[-3:] = 0.0, 1.0
        return np.asarray(values)


def time_optimal_on_line(prepared: PreparedProblem, q_start: Array, q_goal: Array) -> TimeOptimalScaling | None:
    """The shortest law under speed, acceleration and torque limits, None where there is none.

    The motor torque's limit is relaxed by the most that friction can lend: the result stays a bound.
    """
    limits, model = prepared.problem.arm.active_limits, prepared.model
    displacement = q_goal - q_start
    if not np.abs(displacement).max() > 0:
        return TimeOptimalScaling(np.linspace(0.0, 1e-9, len(GRID)))
    data = model.createData()

    def torque(q: Array, v: Array, a: Array) -> Array:
        return np.asarray(pin.rnea(model, data, q, v, a))

    tau = limits.tau_max + prepared.friction.torque(limits.v_max)
    none = np.zeros(len(displacement))
    path = toppra.SimplePath(np.array([0.0, 1.0]), np.array([q_start, q_goal]), np.array([displacement, displacement]))
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
    """toppra's constraints on speed and acceleration: kept, since it prints their limits whenever it makes one."""
    v, a = np.array(v_max), np.array(a_max)
    return (
        constraint.JointVelocityConstraint(np.stack([-v, v], axis=1)),
        constraint.JointAccelerationConstraint(np.stack([-a, a], axis=1)),
    )
