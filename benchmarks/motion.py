"""Replays of planners' motions on a fine grid: exact energies, and ratios of values to limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import pinocchio as pin
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.motion.limit_ratios import limit_ratios
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.result.energy import Energy

PERIOD = 1e-3
"""Largest period of the fine grid [s]."""


class Motion(Protocol):
    """A motion of any planner, as a function of time."""

    @property
    def duration(self) -> float:
        """Duration [s]."""

    def sample(self, t: Array) -> tuple[Array, Array, Array, Array | None]:
        """q, v, a and jerk (k, nq) at times t (k,) [s]; jerk is None if the acceleration is
        discontinuous.
        """


@dataclass(frozen=True)
class SplineMotion:
    """A B-spline: knots (m,) [s], control points (n, nq) [rad], degree."""

    knots: Array
    control_points: Array
    degree: int

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.knots[-1] - self.knots[0])

    @cached_property
    def _curve(self) -> BSpline:
        return BSpline(self.knots, self.control_points, self.degree)

    def sample(self, t: Array) -> tuple[Array, Array, Array, Array | None]:
        """See `Motion.sample`."""
        curve = self._curve
        return curve(t), curve(t, 1), curve(t, 2), curve(t, 3)


@dataclass(frozen=True)
class Replay:
    """A motion on the fine grid: duration [s], energy, and the largest ratio of a value to its
    limit per kind of limit.

    `end_error` is the largest joint error at start and goal [rad].
    """

    duration: float
    energy: Energy
    ratios: dict[str, float]
    end_error: float

    @property
    def worst(self) -> float:
        """The largest ratio of a value to its limit."""
        return max(self.ratios.values())


def replay(problem: Problem, motion: Motion, q_start: Array, q_goal: Array) -> Replay:
    """Evaluates a motion between two configurations (nq,) [rad] by Pinocchio and the exact energy
    formulas.
    """
    t, weights = fine_grid(motion.duration)
    q, v, a, jerk = motion.sample(t)
    tau = torques(problem, q, v, a)
    model, data = _model(problem)
    potential = [
        pin.computePotentialEnergy(model, data, np.ascontiguousarray(q[i])) for i in (0, -1)
    ]
    energy = breakdown(weights, v, a, tau, potential[1] - potential[0], problem.arm)
    ends = max(float(np.abs(q[0] - q_start).max()), float(np.abs(q[-1] - q_goal).max()))
    return Replay(motion.duration, energy, _ratios(problem, q, v, a, jerk, tau), ends)


def worst_ratios(problem: Problem, motion: Motion) -> dict[str, float]:
    """The largest ratio of a value to its limit on the fine grid, per kind of limit."""
    t, _ = fine_grid(motion.duration)
    q, v, a, jerk = motion.sample(t)
    return _ratios(problem, q, v, a, jerk, torques(problem, q, v, a))


def torques(problem: Problem, q: Array, v: Array, a: Array) -> Array:
    """Torques (k, nq) [N·m] of rigid bodies and rotors by Pinocchio."""
    model, data = _model(problem)
    rows = zip(*(np.ascontiguousarray(each) for each in (q, v, a)), strict=True)
    return np.array([pin.rnea(model, data, *row) for row in rows])


def fine_grid(duration: float) -> tuple[Array, Array]:
    """Times (k,) [s] including 0 and the duration, and the weights (k,) [s] of Simpson's rule."""
    pairs = max(math.ceil(duration / PERIOD / 2), 50)
    t = np.linspace(0.0, duration, 2 * pairs + 1)
    weights = np.full(len(t), 2.0)
    weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
    return t, weights * (duration / (6 * pairs))


def _model(problem: Problem) -> tuple[pin.Model, pin.Data]:
    payload = problem.arm.payload
    model = problem.arm.robot.loaded_model(
        payload.mass, payload.com, payload.inertia, problem.arm.gravity
    )
    return model, model.createData()


def _ratios(
    problem: Problem, q: Array, v: Array, a: Array, jerk: Array | None, tau: Array
) -> dict[str, float]:
    jerk = np.full_like(a, np.inf) if jerk is None else jerk
    return limit_ratios(
        problem.arm.active_limits, q, v, a, jerk, limited_torque(problem.arm, tau, v, a)
    )
