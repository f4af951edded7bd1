"""Motions of one duration in a B-spline space, with matrices shared by all steps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.motion.bspline import Basis, basis_matrix
from joulepath.optimizer.solve.nlp.control_point_pairs import ControlPointPairs


@dataclass(frozen=True, eq=False)
class TimedMotions(ABC):
    """Motions of duration T [s] with m free control points of r = nq joints, at rest at both ends.

    Arrays may have leading dimensions (...), for several motions at once.
    """

    kernel: Kernel
    basis: Basis
    limits: Limits
    T: float

    @property
    @abstractmethod
    def _rate_places(self) -> list[Array]:
        """Points in [0, 1] of the limits on speed, acceleration and jerk, one array for each."""

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
    def _at_rates(self) -> Array:
        """Map (k, n) from control points to the limited derivatives by τ of orders 1 to 3."""
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
