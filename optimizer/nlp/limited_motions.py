"""Matrices and limits of the motions of one duration in a B-spline space: what an interior-point method works with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array, Limits
from optimizer.energy.kernel import Kernel
from optimizer.nlp.control_point_pairs import ControlPointPairs
from optimizer.trajectories.bspline import Basis, basis_matrix

# points per span at which speed, acceleration and jerk are limited
RATE_POINTS = (2, 4, 12)


@dataclass(frozen=True, eq=False)
class LimitedMotions:
    """Motions of duration T [s] with free control points (m, r). All K limits are on the size of a ratio: of the rates
    at points of every span, of the control points' places in their ranges, and of the limited torques at the nodes."""

    kernel: Kernel
    basis: Basis
    limits: Limits
    T: float

    def unbounded(self) -> Array:
        """Bounds (K,) of 1 on all ratios, for `tightened`."""
        return np.ones(len(self._rate_limits) * self._r + self._m * self._r + len(self.basis.nodes) * self._r)

    def tightened(self, bounds: Array, spans: Array, torque: Array) -> Array:
        """Bounds (K,) tightened by factors ≤ 1 of the rates per span (3, S, r), and of the torques (r,)."""
        factors = []
        for factor, count in zip(spans, RATE_POINTS, strict=True):
            # the first point of a span is the last of the one before
            first = np.minimum(factor, np.concatenate([factor[:1], factor[:-1]]))
            each = np.repeat(factor[:, None], count, axis=1)
            each[:, 0] = first
            factors += [each.reshape(-1, self._r), factor[-1:]]
        rates = np.concatenate(factors).ravel()
        torques = np.tile(torque, len(self.basis.nodes))
        return np.asarray(bounds * np.concatenate([rates, np.ones(self._m * self._r), torques]))

    def points(self, ends: Array, free: Array) -> Array:
        """All control points (n, r) of a motion between `ends` (2, r)."""
        rest = self.basis.resting
        return np.concatenate([np.repeat(ends[:1], rest, axis=0), free, np.repeat(ends[1:], rest, axis=0)])

    def _states(self, ends: Array, free: Array) -> Array:
        """q, v, a at the nodes, (N, 3 r)."""
        return np.asarray((self._at_nodes @ self.points(ends, free)).reshape(len(self.basis.nodes), -1))

    def _speeds(self, y: Array) -> Array:
        return y[:, self._r : 2 * self._r]

    def _rate_part(self, of: Array) -> Array:
        return of[: self._rate_limits.size].reshape(-1, self._r)

    def _place_part(self, of: Array) -> Array:
        first = self._rate_limits.size
        return of[first : first + self._m * self._r].reshape(-1, self._r)

    def _torque_part(self, of: Array) -> Array:
        return of[self._rate_limits.size + self._m * self._r :].reshape(-1, self._r)

    @property
    def _r(self) -> int:
        return self.kernel.nq

    @property
    def _m(self) -> int:
        return self.basis.n - 2 * self.basis.resting

    @cached_property
    def _half(self) -> Array:
        return np.asarray((self.limits.q_max - self.limits.q_min) / 2)

    @cached_property
    def _weights(self) -> Array:
        """Weights (N, 1) [s] of the nodes."""
        return np.asarray(self.T * self.basis.weights)[:, None]

    @cached_property
    def _at_nodes(self) -> Array:
        """From control points to q, v, a at the nodes, (3 N, n)."""
        by_time = self.basis.at_nodes * (self.T ** -np.arange(3.0))[:, None, None]
        return np.ascontiguousarray(by_time.transpose(1, 0, 2)).reshape(-1, self.basis.n)

    @cached_property
    def _D(self) -> Array:
        return np.ascontiguousarray(self._at_nodes[:, self.basis.free])

    @cached_property
    def _rate_places(self) -> list[Array]:
        """Where speed, acceleration and jerk are limited: RATE_POINTS per span, and the end."""
        edges = np.unique(self.basis.knots)
        spans = edges[:-1, None], np.diff(edges)[:, None]
        return [np.append((spans[0] + spans[1] * (np.arange(count) / count)).ravel(), 1.0) for count in RATE_POINTS]

    @cached_property
    def _at_rates(self) -> Array:
        """From control points to the limited first to third derivatives by τ, (k, n)."""
        places = enumerate(self._rate_places, 1)
        return np.concatenate([basis_matrix(self.basis.knots, at, d) for d, at in places])

    @cached_property
    def _R(self) -> Array:
        return np.ascontiguousarray(self._at_rates[:, self.basis.free])

    @cached_property
    def _rate_limits(self) -> Array:
        """Limits (k, r) on the derivatives by τ."""
        by_tau = self.limits.rates * (self.T ** np.arange(1, 4))[:, None]
        return np.repeat(by_tau, [len(each) for each in self._rate_places], axis=0)

    @cached_property
    def _pairs(self) -> ControlPointPairs:
        return ControlPointPairs(self._m, self._r)

    @cached_property
    def _node_products(self) -> Array:
        return self._pairs.node_products(self._D)

    @cached_property
    def _rate_products(self) -> Array:
        return self._pairs.products(self._R)
