"""The time-optimal scaling of the straight line in joint space, by toppra (Pham, Pham 2018).

toppra limits speed, acceleration and torque, but not jerk. Its duration is therefore a lower bound
for every motion along the line. Its scaling decides whether there is a motion, and is the initial
guess.

toppra is imported by the function that calls it: it imports matplotlib, and only one method needs
it.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import greville
from joulepath.optimizer.prepared_problem import PreparedProblem

logging.getLogger("toppra").setLevel(logging.ERROR)


@dataclass(frozen=True)
class TimeOptimalSettings:
    """Settings of toppra."""

    points: int = 31
    """Points of the line at which its constraints hold."""
    bound_share: float = 0.98
    """Share of its duration that is taken as a lower bound: between the points, its constraints may
    be broken."""


TIME_OPTIMAL = TimeOptimalSettings()
GRID = np.linspace(0.0, 1.0, TIME_OPTIMAL.points)


@dataclass(frozen=True)
class TimeOptimalScaling:
    """Time scaling of the straight line, from rest to rest."""

    times: Array
    """Times at which the fractions GRID of the line are reached, shape (points,) [s]."""

    @property
    def duration_bound(self) -> float:
        """Lower bound on the duration of every motion along the line [s]."""
        return TIME_OPTIMAL.bound_share * float(self.times[-1])

    def fractions(self, knots: Array) -> Array:
        """Control values (n,) of a spline over clamped knots of [0, 1] along the scaling."""
        values = np.interp(greville(knots) * self.times[-1], self.times, GRID)
        values[:3], values[-3:] = 0.0, 1.0
        return np.asarray(values)


def time_optimal_on_line(
    prepared: PreparedProblem, q_start: Array, q_goal: Array
) -> TimeOptimalScaling | None:
    """Time-optimal scaling under limits on speed, acceleration and torque.

    The torque limit of a motor is relaxed by the largest assistance of friction, so that the
    duration is a lower bound.

    Args:
        prepared: the problem.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].

    Returns:
        The scaling; None if the torque limits allow none.
    """
    from toppra.algorithm import TOPPRA

    from joulepath.optimizer.solve.methods.line_in_toppra import LineLimits, StraightLine

    if not np.abs(q_goal - q_start).max() > 0:
        return TimeOptimalScaling(np.linspace(0.0, 1e-9, len(GRID)))
    scaling = TOPPRA(
        [LineLimits(prepared)], StraightLine(q_start, q_goal), GRID, solver_wrapper="seidel"
    )
    _, speed, _ = scaling.compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        return None
    steps = 2 * np.diff(GRID) / (speed[1:] + speed[:-1])
    return TimeOptimalScaling(np.concatenate([[0.0], np.cumsum(steps)]))
