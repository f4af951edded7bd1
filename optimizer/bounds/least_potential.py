"""The least value Ψ of a dual bound's terms of position in each step; the proof is in
`dual_bound`."""

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

# τ of the proof: what the others' share of a momentum's change is weighted with
_TAU = 1.0


@dataclass(frozen=True)
class LeastPotential:
    """Ψ of a path's terms."""

    terms: PathTerms

    def __call__(self, weights: Weights, fast: Array, slow: Array) -> Array:
        """Ψ (B, S) [W] for 1 / T from `slow` to `fast` (B,) [1/s]."""
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
        """Addresses of the terms as the C has them, in its order, and the arrays themselves."""
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
        """What the square of the momentum's change takes from the stiffness (S, others) of the
        joints beside the grid, by 1 / T²."""
        moved = weights.scale * self.terms.momentum_others
        return np.asarray(
            (1 + 1 / _TAU)
            * ((moved / weights.mixing) * moved.sum(axis=1, keepdims=True)).sum(axis=-1)
        )


def _hold(weights: Weights) -> Array:
    """κ π² (nq,)."""
    return np.asarray(weights.confinement * np.pi**2)


def _weight(weights: Weights) -> Array:
    """(1 + τ) / (2 μ) (nq,) times the square of the multipliers' factor."""
    return np.asarray(weights.scale**2 * (1 + _TAU) / (2 * weights.mixing))


def _excess(fast: Array, slow: Array) -> Array:
    """How far (B,) β Γ' exceeds the slope that it has at both ends of a cell, as a share of it; see
    `dual_bound`.
    """
    return np.asarray((fast - slow) ** 2 / (4 * fast * slow))
