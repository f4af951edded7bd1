"""Gravity and inertia terms of a dual bound on a grid around its path, with bounds between its
points.

Between the two ends of a step, interpolation between the values at the same offset from the path
errs by at most 1 / 8 of the bound on the second derivative over the step. The same holds for the
interpolation between bounds at both ends.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.grid_cells import Curvature, GridCells, Spacing
from joulepath.optimizer.bounds.path_curvature import DIFFERENCE_STEP, PathCurvature
from joulepath.optimizer.bounds.reference import Reference
from joulepath.optimizer.native.shared_library import address, library


@dataclass(frozen=True)
class PathTerms:
    """Terms of a path and its multipliers ω = 2 c λ at both ends of each of S steps.

    Terms are given at K points of a grid, shape (S, 2, K), and in its cells, shape (S, 2, cells,
    ...). Primes are derivatives by the share of the duration, N = Σ_i ω_i ∂_i M.
    """

    cells: GridCells
    grid: tuple[int, int]
    """Joints of the grid."""
    others: tuple[int, ...]
    """The other joints."""
    half: Array
    """Half sides of the boxes that hold all motions, shape (S, nq) [rad]."""
    omega: Array
    """ω at the nodes, shape (S + 1, nq) [rad/s]."""
    x_rate: Array
    """x', shape (S, nq) [rad]."""
    gravity: Array
    """ω · g at the points [W]."""
    slope: Array
    """Gradient of ω · g on the path, mean of both ends of a step, shape (S, nq)."""
    momentum: Array
    """M ω' + N x' on the path, mean of both ends of a step, shape (S, nq)."""
    kinetic: Array
    """ω' · M x' + x' · N x' / 2 at the points, less `kinetic_mean`."""
    kinetic_mean: Array
    """Its value on the path, mean of both ends of a step, shape (S,)."""
    deviation: Array
    """Bounds on |M ω' + N x' - momentum| in the cells, shape (S, 2, cells, nq)."""
    steepness: Array
    """Bounds on |gradient of ω · g - slope| by the other joints, shape (S, 2, cells, others)."""
    gravity_curvature: Curvature
    kinetic_curvature: Curvature
    gravity_others: Array
    """Row sums of bounds on second derivatives of ω · g by other joints, shape (S, others)."""
    kinetic_others: Array
    """Bounds on first derivatives of the kinetic term by other joints, shape (S, others)."""
    momentum_others: Array
    """Bounds on first derivatives of M ω' + N x' by other joints, shape (S, others, nq)."""
    spread: Array
    """ν with w · N w ≤ Σ_j ν_j w_j² anywhere in the boxes, shape (S, nq)."""


def path_terms(
    chain: ChainDerivatives,
    reference: Reference,
    loss: Array,
    half: Array,
    grid: tuple[int, int],
    spacing: Spacing,
) -> PathTerms:
    """The terms of a path.

    Args:
        chain: chain of the arm.
        reference: path and multipliers.
        loss: copper loss c, shape (nq,) [W/(N·m)²].
        half: half sides of the boxes that hold all motions, shape (S, nq) [rad].
        grid: joints of the grid.
        spacing: spacing of the grid.
    """
    x, S, nq = reference.x, reference.steps, chain.nq
    omega = 2 * loss * reference.multipliers
    x_rate, omega_rate = np.diff(x, axis=0) * S, np.diff(omega, axis=0) * S
    cells = GridCells(
        (spacing.axis(float(half[:, grid[0]].max())), spacing.axis(float(half[:, grid[1]].max())))
    )
    positions = cells.points()
    offsets = np.zeros((len(positions), nq))
    offsets[:, grid] = positions
    points = GridPoints.of(chain, x, omega, offsets, cells.needed(half[:, grid]))
    others = tuple(j for j in range(nq) if j not in grid)
    bounds = PathCurvature(chain, np.diff(x, axis=0), omega, grid, others)
    kinetic_curvature, momentum_curvature = bounds.inertia(np.abs(omega_rate), np.abs(x_rate))
    slope, momentum, kinetic_mean = (
        each[:, :, cells.centre].mean(axis=1)
        for each in (points.slope, points.momentum, points.kinetic)
    )
    return PathTerms(
        cells,
        grid,
        others,
        half,
        omega,
        x_rate,
        points.gravity,
        slope,
        momentum,
        points.kinetic - kinetic_mean[:, None, None],
        kinetic_mean,
        cells.deviation(points.momentum, momentum, momentum_curvature, range(nq)),
        cells.deviation(points.slope, slope, bounds.slope(), others),
        bounds.gravity(),
        kinetic_curvature,
        *bounds.others_of(np.abs(omega_rate), np.abs(x_rate)),
        bounds.spread(points.rows, np.array([np.diff(axis).max() for axis in cells.axes]), half),
    )


@dataclass(frozen=True)
class GridPoints:
    """Terms at both ends of each of S steps and K points, with N = Σ_i ω_i ∂_i M.

    Primes are derivatives by the share of the duration. Terms are 0 at points that are not needed.
    """

    gravity: Array
    """ω · g, shape (S, 2, K) [W]."""
    slope: Array
    """Gradient of ω · g, shape (S, 2, K, nq)."""
    kinetic: Array
    """ω' · M x' + x' · N x' / 2, shape (S, 2, K)."""
    momentum: Array
    """M ω' + N x', shape (S, 2, K, nq)."""
    rows: Array
    """Greatest max(N_jj, 0) + Σ_{k≠j} |N_jk| over the points of a node, shape (S + 1, nq)."""

    @classmethod
    def of(
        cls, chain: ChainDerivatives, x: Array, omega: Array, offsets: Array, needed: Mask
    ) -> GridPoints:
        """The terms around a path.

        Args:
            chain: chain of the arm.
            x: nodes of the path, shape (S + 1, nq) [rad].
            omega: ω at the nodes, shape (S + 1, nq) [rad/s].
            offsets: points relative to the path, shape (K, nq) [rad].
            needed: points that a motion may come near, shape (S + 1, K).
        """
        S, nq, K = len(x) - 1, chain.nq, len(offsets)
        scalar, by_joint = (S, 2, K), (S, 2, K, nq)
        points = cls(*map(np.zeros, (scalar, by_joint, scalar, by_joint, (S + 1, nq))))
        path = [np.ascontiguousarray(each) for each in (x, omega, offsets, needed)]
        result = points.gravity, points.slope, points.kinetic, points.momentum, points.rows
        library.grid_points(
            ctypes.addressof(chain.as_c[0]),
            S,
            K,
            DIFFERENCE_STEP,
            *map(address, (*path, *result)),
        )
        return points
