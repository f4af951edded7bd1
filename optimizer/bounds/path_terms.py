"""Gravity and inertia terms of a dual bound on a grid around its path, with bounds on what lies
between grid points.

Between the two ends of a step of the path, interpolation between the ends' values at the same
offset from it errs by no more than 1 / 8 of the bound on the second derivative over the step; so
does that between the bounds of both ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.grid_cells import Curvature, GridCells, Spacing
from joulepath.optimizer.bounds.grid_points import GridPoints
from joulepath.optimizer.bounds.path_curvature import PathCurvature
from joulepath.optimizer.bounds.reference import Reference


@dataclass(frozen=True)
class PathTerms:
    """Terms of a path and its multipliers ω = 2 c λ at both ends of each step: at points, (S, 2,
    K), and in cells of the grid, (S, 2, cells, ...).

    With x' and ω' for the derivatives by the share of the duration, N = Σ_i ω_i ∂_i M: `gravity` =
    ω · g [W]; `slope` (S, nq) = its gradient and `momentum` (S, nq) = M ω' + N x', on the path, the
    means of a step's ends. `kinetic` = ω' · M x' + x' · N x' / 2, less such a mean, `kinetic_mean`
    (S,). In a cell, `deviation` (..., nq) bounds |M ω' + N x' - momentum|, and `steepness` (...,
    others) |gradient - slope|. `spread` (S, nq) bounds how far w · N w exceeds zero by w², for
    every joint and anywhere in the boxes. `others` are the joints beside the two of the grid; by
    them, `gravity` has second derivatives whose rows add up to at most `gravity_others` (S,
    others), and `kinetic_others` (S, others) and `momentum_others` (S, others, nq) bound the first
    derivatives.
    """

    cells: GridCells
    grid: tuple[int, int]
    others: tuple[int, ...]
    half: Array
    omega: Array
    x_rate: Array
    gravity: Array
    slope: Array
    momentum: Array
    kinetic: Array
    kinetic_mean: Array
    deviation: Array
    steepness: Array
    gravity_curvature: Curvature
    kinetic_curvature: Curvature
    gravity_others: Array
    kinetic_others: Array
    momentum_others: Array
    spread: Array


def path_terms(
    chain: ChainDerivatives,
    reference: Reference,
    loss: Array,
    half: Array,
    grid: tuple[int, int],
    spacing: Spacing,
) -> PathTerms:
    """The terms for copper loss `loss` (nq,) [W/(N·m)²], boxes of half sides `half` (S, nq) and the
    joints `grid`.
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
