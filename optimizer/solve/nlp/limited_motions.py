"""The limits of motions of one duration as bounds on ratios: what an interior-point method works
with.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.timed_motions import TimedMotions

# points per span at which speed, acceleration and jerk are limited
RATE_POINTS = (2, 4, 12)


class LimitedMotions(TimedMotions):
    """`TimedMotions` with K limits, all on the size of a ratio: of the rates at points of every
    span, of the control points' places in their ranges, and of the limited torques at the nodes."""

    def unbounded(self) -> Array:
        """Bounds (K,) of 1 on all ratios, for `tightened`."""
        return np.ones(
            len(self._rate_limits) * self._r + self._m * self._r + len(self.basis.nodes) * self._r
        )

    def tightened(self, bounds: Array, spans: Array, torque: Array) -> Array:
        """Bounds (K,) tightened by factors ≤ 1 of the rates per span (3, S, r), and of the torques
        (r,).
        """
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

    def _speeds(self, y: Array) -> Array:
        return y[:, self._r : 2 * self._r]

    def _rate_part(self, of: Array) -> Array:
        return of[: self._rate_limits.size].reshape(-1, self._r)

    def _place_part(self, of: Array) -> Array:
        first = self._rate_limits.size
        return of[first : first + self._m * self._r].reshape(-1, self._r)

    def _torque_part(self, of: Array) -> Array:
        return of[self._rate_limits.size + self._m * self._r :].reshape(-1, self._r)

    @cached_property
    def _half(self) -> Array:
        return np.asarray((self.limits.q_max - self.limits.q_min) / 2)

    @cached_property
    def _rate_places(self) -> list[Array]:
        """Where speed, acceleration and jerk are limited: RATE_POINTS per span, and the end."""
        edges = np.unique(self.basis.knots)
        spans = edges[:-1, None], np.diff(edges)[:, None]
        return [
            np.append((spans[0] + spans[1] * (np.arange(count) / count)).ravel(), 1.0)
            for count in RATE_POINTS
        ]
