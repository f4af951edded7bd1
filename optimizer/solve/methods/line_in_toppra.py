"""A straight line in joint space, and the limits of an arm along the line, as types of toppra.

Joint speeds and accelerations are proportional to ds/dt and d²s/dt² of the fraction s of the line.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from toppra.constraint import LinearConstraint
from toppra.interpolator import AbstractGeometricPath

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.limited_torque import greatest_smooth_part, limited_parts
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates


class StraightLine(AbstractGeometricPath):  # type: ignore[misc]
    """The line from q_start to q_goal (nq,) [rad] over s ∈ [0, 1]."""

    path_interval = (0.0, 1.0)

    def __init__(self, q_start: Array, q_goal: Array) -> None:
        self.q_start, self.displacement = q_start, q_goal - q_start

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.q_start)

    def __call__(self, path_positions: Array, order: int = 0) -> Array:
        """Positions (k, nq) [rad] at fractions (k,), or a derivative of an order by s."""
        s = np.asarray(path_positions)[..., None]
        if order == 0:
            return np.asarray(self.q_start + s * self.displacement)
        return np.broadcast_to(self.displacement if order == 1 else 0.0, (*s.shape[:-1], self.dof))


class LineLimits(LinearConstraint):  # type: ignore[misc]
    """Limits of an arm on speed, acceleration and torque along a straight line.

    The torque limit of a motor is relaxed by the largest assistance of friction.
    """

    def __init__(self, prepared: PreparedProblem) -> None:
        super().__init__()
        self.prepared = prepared
        self.identical = True

    def compute_constraint_params(
        self, path: StraightLine, gridpoints: Array, *_: Any
    ) -> tuple[Array, ...]:
        """Parameters of toppra's constraint F (a u + b x + c) ≤ g on the smooth part of the torque.

        Args:
            path: the straight line.
            gridpoints: fractions of the line, shape (k,).

        Returns:
            a, b, c (k, nq), F, g, and bounds (k, 2) of u = d²s/dt² and x = (ds/dt)².
        """
        arm, count = self.prepared.arm, len(gridpoints)
        rates = Coordinates.straight_line(
            path.q_start, path.q_start + path.displacement, arm.active_limits
        ).limits
        q, d, none = path(gridpoints), path(gridpoints, 1), np.zeros((count, path.dof))
        v, a = np.concatenate([none, none, d]), np.concatenate([none, d, none])
        tau = self.prepared.torques(np.concatenate([q, q, q]), v, a)
        still, accelerated, moving = np.split(limited_parts(arm, tau, v, a)[0], 3)
        limit, each = greatest_smooth_part(arm), np.eye(path.dof)
        return (
            accelerated - still,
            moving - still,
            still,
            np.concatenate([each, -each]),
            np.concatenate([limit, limit]),
            np.tile(np.concatenate([-rates.a_max, rates.a_max]), (count, 1)),
            np.tile(np.append(0.0, rates.v_max**2), (count, 1)),
        )
