"""Coordinates of a candidate's spline, and constraints on a goal that is a decision variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits

# least displacement of a joint [rad] by which its limits are divided on a straight line
LEAST_DISPLACEMENT = 1e-12


@dataclass(frozen=True)
class Coordinates:
    """Coordinates s (r,) of a spline from `start` to `goal` (r,): q = origin (nq,) + directions
    (nq, r) · s.

    `limits` are those of s, (r,) each, except `tau_max` (nq,) [N·m], which stays per joint.
    """

    origin: Array
    directions: Array
    start: Array
    goal: Array
    limits: Limits

    @staticmethod
    def joints(q_start: Array, q_goal: Array, limits: Limits) -> Coordinates:
        """Every joint has a spline of its own."""
        nq = len(q_start)
        return Coordinates(np.zeros(nq), np.eye(nq), q_start, q_goal, limits)

    @staticmethod
    def straight_line(q_start: Array, q_goal: Array, limits: Limits) -> Coordinates:
        """All joints share one time scaling s ∈ [0, 1] along the straight line from start to
        goal."""
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
    """Linear constraints on the displacement of the goal: lower ≤ rows · (goal - coordinates.goal)
    ≤ upper.

    rows (c, r), lower and upper (c,); equal bounds make an equation. `radius` bounds the
    displacement of every coordinate (trust region).
    """

    rows: Array
    lower: Array
    upper: Array
    radius: float
