"""Coordinates in which the spline of a candidate runs, and constraints on a goal that may move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array, Limits

# displacement below this counts as none where a shared time law is limited by the joints' own limits [rad]
SHORTEST_TRAVEL = 1e-12


@dataclass(frozen=True)
class Coordinates:
    """What the spline runs in: q = origin (nq,) + directions (nq, r) · s, from `start` to `goal` (r,).

    `limits` are those of s, (r,) each, but for `tau_max` (nq,), which stays per joint.
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
        """All joints share one time law s ∈ [0, 1] along the straight line from start to goal."""
        displacement = q_goal - q_start
        length = np.maximum(np.abs(displacement), SHORTEST_TRAVEL)
        zero, one = np.zeros(1), np.ones(1)
        v_max, a_max, j_max = (np.array([(m / length).min()]) for m in (limits.v_max, limits.a_max, limits.j_max))
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
        """s (k, r) of the points nearest to q (k, nq)."""
        return np.asarray((q - self.origin) @ np.linalg.pinv(self.directions).T)


@dataclass(frozen=True)
class GoalConstraints:
    """How far the goal may move from where it is: lower ≤ rows · (goal - coordinates.goal) ≤ upper, linear.

    rows (c, r), lower and upper (c,), equal where the goal may not move that way; `radius` bounds every coordinate's.
    """

    rows: Array
    lower: Array
    upper: Array
    radius: float
