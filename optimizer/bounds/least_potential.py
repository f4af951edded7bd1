"""Minima Ψ of the position terms of a dual bound on the steps of a path; proof in `dual_bound`."""

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
    """Lower bounds on the minimum Ψ of the position terms around a path."""

    terms: PathTerms

    def __call__(self, weights: Weights, fast: Array, slow: Array) -> Array:
        """Bounds on Ψ for B intervals of the duration T, shape (B, S) [W].

        Args:
            weights: weights of the bound.
            fast: greatest 1 / T of the intervals, shape (B,) [1/s].
            slow: least 1 / T of the intervals, shape (B,) [1/s].
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
        """Addresses of the terms in the order of the C arguments, and the arrays they point to."""
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
        """Reduction of the stiffness by the momentum's dependence on the other joints.

        For joint l it is (1 + 1 / τ) Σ_j a_lj (Σ_m a_mj) / μ_j in the symbols of the proof. The
        result, shape (S, others), is a factor of 1 / T².
        """
        moved = weights.scale * self.terms.momentum_others
        return np.asarray(
            (1 + 1 / TAU)
            * ((moved / weights.mixing) * moved.sum(axis=1, keepdims=True)).sum(axis=-1)
        )


def _hold(weights: Weights) -> Array:
    """Stiffness κ π² of the confinement, shape (nq,), as a factor of 1 / T²."""
    return np.asarray(weights.confinement * np.pi**2)


def _weight(weights: Weights) -> Array:
    """Factor (1 + τ) / (2 μ) of the squared momentum, times the squared scale, shape (nq,)."""
    return np.asarray(weights.scale**2 * (1 + TAU) / (2 * weights.mixing))


def _excess(fast: Array, slow: Array) -> Array:
    """Greatest excess of Γ̇ over the gradient within an interval, relative to it, shape (B,)."""
    return np.asarray((fast - slow) ** 2 / (4 * fast * slow))
