"""The least value Ψ of a dual bound's terms of position in each step; the proof is in `dual_bound`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from models.robot import Array
from optimizer.bounds.path_terms import Curvature, PathTerms

# τ of the proof: what the others' share of a momentum's change is weighted with
_TAU = 1.0


def least_potential_terms(
    terms: PathTerms,
    scale: float,
    confinement: Array,
    mixing: Array,
    pull: Array,
    momentum: Array,
    fast: Array,
    slow: Array,
) -> Array:
    """Ψ (B, S) [W] for multipliers times `scale`, κ `confinement` and μ `mixing` (nq,), Γ' `pull` and ρ̄ `momentum`
    (B, S, nq), and 1 / T from `slow` to `fast` (B,) [1/s].
    """
    grid = _Grid(terms)
    hold = confinement * np.pi**2
    square = terms.offsets**2 @ hold / 2  # κ π² δ² / 2 at the grid's points
    corner, deviation, slope = np.array(np.inf), np.zeros(1), np.zeros(1)
    range_ = (fast - slow)[:, None, None, None]
    for beta in (fast, slow):
        at = beta[:, None, None, None]
        along = (beta[:, None, None] * pull) @ terms.offsets.T
        value = scale * (terms.gravity - at**2 * terms.kinetic) - along[:, :, None] + at**2 * square
        corner = np.minimum(corner, value)
        change = at[..., None] * scale * terms.momentum - momentum[:, :, None, None]
        deviation = np.maximum(deviation, np.abs(change))
        rise = scale * terms.torque_slope - (beta[:, None, None] * pull)[:, :, None, None]
        slope = np.maximum(slope, np.abs(rise))
    corner = corner - range_**2 / 4 * np.maximum(square - scale * terms.kinetic, 0.0)
    b2 = fast[:, None] ** 2
    bend = scale * (terms.gravity_curvature.across + b2[..., None] * terms.kinetic_curvature.across)
    bend = bend + b2[..., None] * hold[[j for j in range(len(hold)) if j not in terms.others]]
    value = grid.cells(corner, np.minimum)
    value -= grid.between(bend) + grid.spread(
        scale * (terms.gravity_curvature.along + b2 * terms.kinetic_curvature.along)
    )
    deviation = grid.cells(deviation, np.maximum) + grid.of(terms.momentum_curvature, scale * fast[:, None, None])
    value -= (1 + _TAU) * (deviation**2 / (2 * mixing)).sum(axis=-1)
    slope = grid.cells(slope, np.maximum) + grid.of(terms.slope_curvature, np.full((len(fast), 1, 1), scale))
    value -= _others(grid, scale, hold, mixing, slope, fast, slow)
    value = value + grid.beyond
    return np.asarray(value.reshape(*value.shape[:2], -1).min(axis=-1))


def _others(grid: _Grid, scale: float, hold: Array, mixing: Array, slope: Array, fast: Array, slow: Array) -> Array:
    """What the joints beside the grid's can take from Ψ (B, S, cells...) [W]."""
    terms, b2 = grid.terms, fast[:, None] ** 2
    moved = scale * terms.momentum_others
    cross = (1 + 1 / _TAU) * np.einsum("slk,smk,k->sl", moved, moved, 1 / mixing)
    taken = np.zeros(slope.shape[:-1])
    for i, joint in enumerate(terms.others):
        stiffness = hold[joint] * slow[:, None] ** 2 - scale * terms.gravity_others[:, i] - b2 * cross[:, i]
        stiffness = grid.spread(stiffness)
        s = slope[..., joint] + grid.spread(b2 * scale * terms.kinetic_others[:, i])
        half = grid.spread(np.broadcast_to(terms.half[:, joint], (len(fast), len(terms.half))))
        stable = stiffness > 0
        far = np.where(stable, np.minimum(s / np.where(stable, stiffness, 1.0), half), half)
        taken += s * far - stiffness * far * far / 2
    return taken


class _Grid:
    """The grid's cells: values of corners reduced to cells (B, S, cells...)."""

    def __init__(self, terms: PathTerms) -> None:
        self.terms = terms
        self.points = tuple(len(axis) for axis in terms.axes)
        self.squares = [np.diff(axis) ** 2 / 8 for axis in terms.axes]

    @cached_property
    def beyond(self) -> Array:
        """inf for a cell (1, S, cells...) beyond the box of its step, where no motion is, 0 for the others."""
        terms = self.terms
        joints = [j for j in range(terms.half.shape[1]) if j not in terms.others]
        beyond: Array = np.zeros(1)
        for k, (joint, axis) in enumerate(zip(joints, terms.axes, strict=True)):
            nearest = np.minimum(np.abs(axis[:-1]), np.abs(axis[1:]))
            along = [1] * (2 + len(self.points))
            along[2 + k] = len(nearest)
            outside = nearest.reshape(along) > self.spread(terms.half[None, :, joint])
            beyond = beyond + np.where(outside, np.inf, 0.0)
        return beyond

    def cells(self, corners: Array, reduce: Callable[[Array, Array], Array]) -> Array:
        """The least or greatest (B, S, cells..., ...) of the corners (B, S, 2, K, ...) of each cell."""
        value = reduce(corners[:, :, 0], corners[:, :, 1])
        value = value.reshape(*value.shape[:2], *self.points, *value.shape[3:])
        for k in range(2, 2 + len(self.points)):
            first = np.take(value, range(value.shape[k] - 1), axis=k)
            value = reduce(first, np.take(value, range(1, value.shape[k]), axis=k))
        return np.asarray(value)

    def spread(self, value: Array) -> Array:
        """Values (B, S, ...) for every cell of a step."""
        return value.reshape(*value.shape[:2], *(1 for _ in self.points), *value.shape[2:])

    def between(self, second: Array) -> Array:
        """Σ h² / 8 · second (B, S, grid joints, ...) over the sides of each cell."""
        total: Array = np.zeros(1)
        for k, square in enumerate(self.squares):
            along = [1] * (2 + len(self.points)) + [1] * (second.ndim - 3)
            along[2 + k] = len(square)
            total = total + self.spread(second[:, :, k]) * square.reshape(along)
        return total

    def of(self, curvature: Curvature, factor: Array) -> Array:
        """What a term with a value per joint can differ by from its corners; factor (B, 1, 1)."""
        return self.between(factor[..., None] * curvature.across) + self.spread(factor * curvature.along)
