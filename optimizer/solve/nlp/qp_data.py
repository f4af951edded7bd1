"""Input and solution of the QP of one SQP step, with helpers on masks and steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.solve.nlp.active_path_constraints import Index, PathConstraintValues
from joulepath.optimizer.solve.nlp.nonlinear_program import Linearisation
from joulepath.optimizer.solve.nlp.qp_rows import Places


@dataclass(frozen=True)
class QPInputs:
    """The QP at one iterate."""

    hessian: Callable[[Array], Array]
    """Product of the Hessian H with a step (n,) in the scaled variables."""

    whitening: Array
    """W with Wᵀ H W = 1, shape (n, k), for steps that keep passes and sliding ends."""

    gradient: Array
    """Gradient of the scaled cost by the scaled variables, shape (n,)."""

    free: Array
    """Free control points, shape (m, r)."""

    T: float
    """Duration [s]."""

    line: Linearisation
    """Cost and torques with their derivatives."""

    path_values: PathConstraintValues
    """Path constraints at the path points."""

    rates: Array
    """Limits on the derivatives of s by τ, shape (3, r)."""

    ratio: Array
    """Derivatives of s by τ over their limits on the grid, shape (3, r, M)."""


@dataclass(frozen=True)
class QPStep:
    """Solution of a QP, with the multipliers ≥ 0 of its constraints."""

    x: Array
    """Step in the scaled variables, shape (n,)."""

    relaxed: bool
    """Whether the QP was infeasible: then the step violates its constraints as little as
    possible."""

    places: Places
    """Derivative, coordinate and grid point of every limit on rates in the QP."""

    kinematic: Array
    """Multipliers of the limits on rates, shape (rows,)."""

    nodes: tuple[Index, Index]
    """Node and joint of every torque limit in the QP."""

    signs: Array
    """Signs of these torques, shape (rows,)."""

    torque: Array
    """Multipliers of the torque limits, shape (rows,)."""

    passed: tuple[Index, Index]
    """Path point and column of every path constraint in the QP."""

    path: Array
    """Multipliers of the path constraints, shape (rows,)."""

    pull: Array
    """Σ multiplier · gradient of the constraints, shape (n,); zero without passes or sliding
    ends."""


@dataclass(frozen=True)
class TorqueRows:
    """Torques near their limits, as ratios of the limits."""

    nodes: tuple[Index, Index]
    """Node and joint of every torque."""

    signs: Array
    """Signs of the torques, shape (rows,)."""

    gradients: Array
    """Gradients of the absolute torques, shape (rows, n)."""

    slack: Array
    """Distances to the limits, shape (rows,)."""


def shortened(x: Array, bounds: Array, tolerance: float) -> Array:
    """The step, shortened to its bounds (2, n): rounds may end before every bound has its row."""
    most = np.where(x > 0, bounds[1], bounds[0])
    beyond = np.abs(x) > np.abs(most) + tolerance
    return np.asarray(x * np.min(np.abs(most[beyond] / x[beyond]), initial=1.0))


def peaks(size: Array) -> Mask:
    """Mask of the local maxima of size (k, M) ≥ 0 along the grid."""
    high = np.ones(size.shape, dtype=bool)
    rising = size[:, 1:] >= size[:, :-1]
    high[:, 1:] = rising
    high[:, :-1] &= ~rising
    return high


def places_of(marks: Mask) -> tuple[Index, ...]:
    """Indices of marks: several times as fast in one dimension as `np.nonzero` in two or three."""
    return np.unravel_index(np.flatnonzero(marks), marks.shape)
