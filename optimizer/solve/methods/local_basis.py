"""Basis functions at instants, of the few control points that move there.

A point of a spline of degree five depends on six control points. Products with them alone take a
fraction of the operations of products with whole basis matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.solve.nlp.active_path_constraints import Index

_MOVING = DEGREE + 1
"""Number of control points that move a point."""


@dataclass(frozen=True, eq=False)
class LocalBasis:
    """Basis functions and their derivatives at k instants."""

    values: Array
    """Values (d, k, 6) of the moving control points, by derivative."""

    first: Index
    """First moving control point of every instant, shape (k,), in ascending order."""

    count: int
    """Number n of all control points."""

    @classmethod
    def of(cls, matrix: Array) -> LocalBasis:
        """Basis of the values (d, k, n) at all control points."""
        count = matrix.shape[2]
        first = np.minimum((matrix != 0).any(axis=0).argmax(axis=1), count - _MOVING)
        moving = first[:, None] + np.arange(_MOVING)
        values = np.take_along_axis(
            matrix, np.broadcast_to(moving, (len(matrix), *moving.shape)), 2
        )
        return cls(values, first, count)

    def rows(self, instants: Index, by_z: Array) -> csr_matrix:
        """Derivatives (r, n nq) of functions by the control points, row by row.

        Args:
            instants: instants of the functions, shape (r,).
            by_z: derivatives of the functions by the derivatives of the spline, shape (r, d, nq).
        """
        nq = by_z.shape[2]
        values = self.values[:, instants].transpose(1, 2, 0) @ by_z
        columns = (self.first[instants] * nq)[:, None] + np.arange(_MOVING * nq)
        ends = np.arange(len(instants) + 1) * _MOVING * nq
        return csr_matrix(
            (values.ravel(), columns.ravel(), ends), shape=(len(instants), self.count * nq)
        )

    def congruent(self, bends: Array, slopes: Array) -> Array:
        """Σ_k (D_k S)ᵀ H_k (D_k S), shape (m, m), with the basis D_k of an instant.

        Every span must have the same number of instants.

        Args:
            bends: symmetric matrices H_k by the derivatives of the spline, shape (k, d, nq, d, nq).
            slopes: derivatives S of the control points by m variables, shape (n, nq, m).
        """
        (_, nq, m), starts = slopes.shape, np.unique(self.first)
        # the blocks of pairs of moving control points, by span
        pairs = bends.transpose(0, 1, 3, 2, 4).reshape(len(starts), -1, nq**2)
        summed = self._products @ pairs
        summed = summed.reshape(-1, _MOVING, _MOVING, nq, nq).transpose(0, 1, 3, 2, 4)
        moving = starts[:, None] + np.arange(_MOVING)
        bent = summed.reshape(-1, _MOVING * nq, _MOVING * nq) @ (
            slopes[moving].reshape(-1, _MOVING * nq, m)
        )
        bent, total = bent.reshape(-1, _MOVING, nq, m), np.zeros_like(slopes)
        for i in range(_MOVING):
            total[moving[:, i]] += bent[:, i]
        return np.asarray(slopes.reshape(-1, m).T @ total.reshape(-1, m))

    @cached_property
    def _products(self) -> Array:
        """Products (spans, 36, p d²) of the basis functions at p instants of a span, two by two."""
        products = np.einsum("dki,ekj->kdeij", self.values, self.values)
        by_span = products.reshape(len(np.unique(self.first)), -1, _MOVING**2)
        return np.ascontiguousarray(by_span.swapaxes(1, 2))
