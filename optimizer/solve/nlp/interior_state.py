"""State of the interior-point method: iterate, values at its nodes, and Newton step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array


@dataclass(frozen=True)
class Interior:
    """An iterate of the interior-point method."""

    free: Array
    """Free control points, shape (m, r) [rad]."""

    slack: Array
    """Slacks of upper and lower limits on ratios, shape (2, K)."""

    price: Array
    """Multipliers of these limits, shape (2, K) [J]."""

    slope: Array
    """Slopes of the smoothed corners, shape (N, r)."""

    limited: Array
    """Limited torques, shape (N, r) [N·m]."""

    barrier: float
    """Barrier parameter [J]."""

    width: float
    """Width of the corners [W]."""

    work: float
    """Smoothed work [J]."""

    scale: float
    """Smoothed work of the first iterate [J]."""

    excess: float = np.inf
    """Largest excess of a ratio over its bound."""

    stationarity: float = np.inf
    """Stationarity, as of `SqpResult`."""

    iterations: int = 0
    """Number of steps so far."""

    converged: bool = False
    """Whether a further step promises too little, and the motion is within its limits."""

    costlier: bool = False
    """Whether the motion was given up as too costly."""


@dataclass(frozen=True)
class InteriorNodes:
    """Powers, torques and ratios of an iterate, with derivatives by q, v, a at the nodes."""

    power: Array
    """Powers, shape (N, r) [W]."""

    smooth: Array
    """Smoothed absolute powers, shape (N, r) [W]."""

    jacobian: Array
    """Jacobian of the powers, shape (N, r, 3 r)."""

    torque_jacobian: Array
    """Jacobian of the limited torques, shape (N, r, 3 r)."""

    hessian: Array
    """Hessian of Σ weight u p + pull · limited torque, shape (N, 3 r, 3 r)."""

    ratio: Array
    """Ratios of the limits, shape (K,)."""


@dataclass(frozen=True)
class InteriorStep:
    """A Newton step."""

    free: Array
    """Step of the free control points, shape (m, r) [rad]."""

    slack: Array
    """Step of the slacks, shape (2, K)."""

    price: Array
    """Step of the prices, shape (2, K) [J]."""

    slope: Array
    """Step of the slopes, shape (N, r)."""

    residual: Array
    """Residuals ratio - bound + slack of the iterate, shape (2, K)."""

    descent: float
    """Slope of cost and barriers along the step [J]."""

    gradient: float
    """Largest component of the Lagrangian's gradient after the step [J/rad]."""
