"""Motions of one duration in a B-spline space, with matrices shared by all steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.motion.bspline import DEGREE, Basis, basis_matrix
from joulepath.optimizer.solve.nlp.active_path_constraints import Index


@dataclass(frozen=True)
class TimedMotionSettings:
    """Settings of motions of one duration."""

    rate_points: int = 4
    """Points per span at which the rates are limited."""


TIMED_MOTIONS = TimedMotionSettings()


@dataclass(frozen=True, eq=False)
class TimedMotions:
    """Motions of duration T [s] with m free control points of r = nq joints, at rest at both ends.

    Arrays may have leading dimensions (...), for several motions at once.
    """

    kernel: Kernel
    basis: Basis
    limits: Limits
    T: float

    def points(self, ends: Array, free: Array) -> Array:
        """All control points (..., n, r), from ends (..., 2, r) and free ones (..., m, r)."""
        rest = self.basis.resting
        start, goal = (
            np.repeat(end, rest, axis=-2) for end in (ends[..., :1, :], ends[..., 1:, :])
        )
        return np.concatenate([start, free, goal], axis=-2)

    def _states(self, points: Array) -> Array:
        """q, v, a at the nodes, (..., N, 3 r), for all control points (..., n, r)."""
        return (self._at_nodes @ points).reshape(*points.shape[:-2], len(self.basis.nodes), -1)

    @cached_property
    def _r(self) -> int:
        return self.kernel.nq

    @cached_property
    def _m(self) -> int:
        return self.basis.n - 2 * self.basis.resting

    @cached_property
    def _weights(self) -> Array:
        """Weights (N,) [s] of the nodes."""
        return np.asarray(self.T * self.basis.weights)

    @cached_property
    def _at_nodes(self) -> Array:
        """Map (3 N, n) from control points to q, v, a at the nodes."""
        by_time = self.basis.at_nodes * (self.T ** -np.arange(3.0))[:, None, None]
        return np.ascontiguousarray(by_time.transpose(1, 0, 2)).reshape(-1, self.basis.n)

    @cached_property
    def _D(self) -> Array:
        return np.ascontiguousarray(self._at_nodes[:, self.basis.free])

    @cached_property
    def _rate_places(self) -> Array:
        """Points (K,) within every span, and the ends, at which the rates are limited."""
        edges = np.unique(self.basis.knots)
        within = (np.arange(TIMED_MOTIONS.rate_points) + 0.5) / TIMED_MOTIONS.rate_points
        inner = edges[:-1, None] + np.diff(edges)[:, None] * within
        return np.concatenate([[0.0], inner.ravel(), [1.0]])

    @cached_property
    def _at_rates(self) -> Array:
        """Map (3 K, n) from control points to the limited derivatives by τ of orders 1 to 3."""
        knots, places = self.basis.knots, self._rate_places
        return np.concatenate([basis_matrix(knots, places, order) for order in (1, 2, 3)])

    @cached_property
    def _R(self) -> Array:
        return np.ascontiguousarray(self._at_rates[:, self.basis.free])

    @cached_property
    def _rate_limits(self) -> Array:
        """Limits (3 K, r) on the derivatives by τ."""
        by_tau = self.limits.rates * (self.T ** np.arange(1, 4))[:, None]
        return np.repeat(by_tau, len(self._rate_places), axis=0)

    @cached_property
    def _pairs(self) -> ControlPointPairs:
        return ControlPointPairs(self._m, self._r)

    @cached_property
    def _node_products(self) -> Array:
        return self._pairs.node_products(self._D)

    @cached_property
    def _rate_products(self) -> Array:
        return self._pairs.products(self._R)


@dataclass(frozen=True)
class ControlPointPairs:
    """Pairs i ≤ j of free control points that move a common span.

    Variables are ordered row by row. A Hessian has a block (r, r) per pair. Its lower band (m r,
    band + 1) has the columns as rows.
    """

    m: int
    """Number of free control points."""

    r: int
    """Number of coordinates."""

    @cached_property
    def pairs(self) -> tuple[Index, Index]:
        """Indices i and j of all pairs."""
        apart = np.subtract.outer(np.arange(self.m), np.arange(self.m))
        i, j = np.nonzero((apart <= 0) & (apart >= -DEGREE))
        return i, j

    @cached_property
    def own(self) -> Index:
        """The pairs of a control point with itself."""
        return np.flatnonzero(self.pairs[0] == self.pairs[1])

    @property
    def band(self) -> int:
        """Number of diagonals below the main one."""
        return min((DEGREE + 1) * self.r, self.m * self.r) - 1

    def products(self, rows: Array) -> Array:
        """Products (pairs, k) of the entries of rows (k, m): the blocks of squared rows."""
        i, j = self.pairs
        return np.ascontiguousarray((rows[:, i] * rows[:, j]).T)

    def node_products(self, rows: Array) -> Array:
        """Products (pairs, 9 N) of the rows (3 N, m) of q, v and a, two by two at every node."""
        i, j = self.pairs
        three = rows.reshape(-1, 3, self.m)
        return np.ascontiguousarray(
            (three[:, :, None, i] * three[:, None, :, j]).reshape(-1, len(i)).T
        )

    def banded(self, blocks: Array) -> Array:
        """Lower bands (..., m r, band + 1) of Hessians by their blocks (..., pairs, r, r)."""
        kept, at = self._band_places
        before = blocks.shape[:-3]
        band = np.zeros((*before, self.m * self.r * (self.band + 1)))
        band[..., at] = blocks.reshape(*before, -1)[..., kept]
        return band.reshape(*before, self.m * self.r, self.band + 1)

    @cached_property
    def _band_places(self) -> tuple[Index, Index]:
        """Entries of the blocks on or below the diagonal, and their places in the band."""
        (i, j), joints = self.pairs, np.arange(self.r)
        rows, columns = np.broadcast_arrays(
            j[:, None, None] * self.r + joints, i[:, None, None] * self.r + joints[:, None]
        )
        below = (rows - columns).ravel()
        kept = np.flatnonzero(below >= 0)
        return kept, (columns.ravel() * (self.band + 1) + below)[kept]
