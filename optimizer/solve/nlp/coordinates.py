"""Coordinates of a candidate's spline, and constraints on a goal that is a decision variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits

# smallest displacement of a joint by which its limits are divided on a straight line [rad]
LEAST_DISPLACEMENT = 1e-12


@dataclass(frozen=True)
class Coordinates:
    """Coordinates s (r,) of a spline, with q = origin + directions · s."""

    origin: Array
    """Configuration at s = 0, shape (nq,) [rad]."""

    directions: Array
    """Derivatives of q by s, shape (nq, r)."""

    start: Array
    """Start of the spline, shape (r,)."""

    goal: Array
    """Goal of the spline, shape (r,)."""

    limits: Limits
    """Limits of s, shape (r,), with `tau_max` per joint, shape (nq,) [N·m]."""

    @staticmethod
    def joints(q_start: Array, q_goal: Array, limits: Limits) -> Coordinates:
        """Coordinates of a spline per joint."""
        nq = len(q_start)
        return Coordinates(np.zeros(nq), np.eye(nq), q_start, q_goal, limits)

    @staticmethod
    def straight_line(q_start: Array, q_goal: Array, limits: Limits) -> Coordinates:
        """Coordinate s ∈ [0, 1] along the straight line, shared by all joints."""
        displacement = q_goal - q_start
        length = np.maximum(np.abs(displacement), LEAST_DISPLACEMENT)
        zero, one = np.zeros(1), np.ones(1)
        v_max, a_max, j_max = (np.array([(m / length).min()]) for m in limits.rates)
        shared = Limits(zero, one, v_max, a_max, j_max, limits.tau_max)
        return Coordinates(q_start, displacement[:, None], zero, one, shared)

    @property
    def r(self) -> int:
        """Number of coordinates."""
        return int(self.directions.shape[1])

    def to_joints(self, points: Array) -> Array:
        """q (n, nq) for s (n, r)."""
        return np.asarray(self.origin + points @ self.directions.T)

    def from_joints(self, q: Array) -> Array:
        """s (k, r) of the points nearest to q (k, nq) [rad]."""
        return np.asarray((q - self.origin) @ np.linalg.pinv(self.directions).T)


@dataclass(frozen=True)
class GoalConstraints:
    """Linear constraints lower ≤ rows · (goal - coordinates.goal) ≤ upper on the goal."""

    rows: Array
    """Gradients, shape (c, r)."""

    lower: Array
    """Lower bounds, shape (c,); equal bounds make an equation."""

    upper: Array
    """Upper bounds, shape (c,)."""

    radius: float
    """Largest displacement of every coordinate (trust region)."""
