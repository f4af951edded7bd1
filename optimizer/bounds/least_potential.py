"""Least values Ψ of a dual bound's terms of position on each step; proof in `dual_bound`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.path_terms import PathTerms
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.native.shared_library import address, library

TAU = 1.0
"""τ of the proof: weight of the other joints in the change of momentum."""


@dataclass(frozen=True)
class LeastPotential:
    """Least values Ψ of the terms of a path."""

    terms: PathTerms

    def __call__(self, weights: Weights, fast: Array, slow: Array) -> Array:
        """Ψ in cells of durations, shape (B, S) [W].

        Args:
            weights: weights of the bound.
            fast: greatest 1 / T of each cell, shape (B,) [1/s].
            slow: least 1 / T of each cell, shape (B,) [1/s].
        """
        terms, (at_terms, _) = self.terms, self._as_c
        S, nq = terms.half.shape
        result = np.empty((len(fast), S))
        own = (
            self._cross(weights),
            _hold(weights),
            _weight(weights),
            fast,
            slow,
            _excess(fast, slow),
            result,
        )
        library.least_potential(
            len(fast),
            S,
            nq,
            *map(len, terms.cells.axes),
            *at_terms,
            weights.scale,
            *map(address, own),
        )
        return result

    @cached_property
    def _as_c(self) -> tuple[list[int], list[NDArray[Any]]]:
        """Addresses of the terms in the order of the C function, and the arrays they point to."""
        terms = self.terms
        given = (
            *terms.cells.axes,
            terms.half,
            terms.gravity,
            terms.kinetic,
            terms.slope,
            terms.deviation,
            terms.steepness,
            terms.gravity_curvature.along,
            terms.gravity_curvature.across,
            terms.kinetic_curvature.along,
            terms.kinetic_curvature.across,
            terms.gravity_others,
            terms.kinetic_others,
        )
        arrays = [
            np.array([*terms.grid, *terms.others]),
            *(np.ascontiguousarray(each) for each in given),
        ]
        return [address(each) for each in arrays], arrays

    def _cross(self, weights: Weights) -> Array:
        """Stiffness (S, others) that the square of the momentum's change takes from other joints,
        by 1 / T².
        """
        moved = weights.scale * self.terms.momentum_others
        return np.asarray(
            (1 + 1 / TAU)
            * ((moved / weights.mixing) * moved.sum(axis=1, keepdims=True)).sum(axis=-1)
        )


def _hold(weights: Weights) -> Array:
    """κ π² (nq,)."""
    return np.asarray(weights.confinement * np.pi**2)


def _weight(weights: Weights) -> Array:
    """(1 + τ) / (2 μ) (nq,) times the square of the multipliers' factor."""
    return np.asarray(weights.scale**2 * (1 + TAU) / (2 * weights.mixing))


def _excess(fast: Array, slow: Array) -> Array:
    """Greatest excess of Γ̇ over the gradient within a cell (B,), as a share of the gradient."""
    return np.asarray((fast - slow) ** 2 / (4 * fast * slow))
