"""Limits of motions of one duration as bounds on ratios, for an interior-point method."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.timed_motions import TimedMotions


class LimitedMotions(TimedMotions):
    """`TimedMotions` with K limits on absolute values of ratios.

    The ratios are, in this order, those of the rates at points of every span, of the control points
    within their ranges, and of the limited torques at the nodes.
    """

    rate_points: ClassVar[tuple[int, int, int]] = (2, 4, 12)
    """Points per span at which speed, acceleration and jerk are limited."""

    def unbounded(self) -> Array:
        """Bounds (K,) of 1 on all ratios, for `tightened`."""
        return np.ones(
            len(self._rate_limits) * self._r + self._m * self._r + len(self.basis.nodes) * self._r
        )

    def tightened(self, bounds: Array, spans: Array, torque: Array) -> Array:
        """Tighten bounds.

        Args:
            bounds: bounds of the ratios, shape (K,).
            spans: factors ≤ 1 of the rates of every span, shape (3, S, r).
            torque: factors ≤ 1 of the torques, shape (r,).

        Returns:
            The tightened bounds, shape (K,).
        """
        factors = []
        for factor, count in zip(spans, self.rate_points, strict=True):
            # the first point of a span is the last point of the span before
            first = np.minimum(factor, np.concatenate([factor[:1], factor[:-1]]))
            each = np.repeat(factor[:, None], count, axis=1)
            each[:, 0] = first
            factors += [each.reshape(-1, self._r), factor[-1:]]
        rates = np.concatenate(factors).ravel()
        torques = np.tile(torque, len(self.basis.nodes))
        return np.asarray(bounds * np.concatenate([rates, np.ones(self._m * self._r), torques]))

    def _change(self, free: Array, torque: Array) -> Array:
        """Changes (K,) of the ratios, for changes of control points (m, r) and torques (N, r)."""
        rates, places = self._R @ free / self._rate_limits, free / self._half
        return np.concatenate(
            [rates.ravel(), places.ravel(), (torque / self.limits.tau_max).ravel()]
        )

    def _ratio(self, ends: Array, free: Array, limited: Array) -> Array:
        """Ratios (K,) of rates, positions and limited torques (N, r) to their limits.

        The ratio of a position is that of its distance from the middle of the range.
        """
        rates = self._at_rates @ self.points(ends, free) / self._rate_limits
        places = (free - (self.limits.q_max + self.limits.q_min) / 2) / self._half
        return np.concatenate(
            [rates.ravel(), places.ravel(), (limited / self.limits.tau_max).ravel()]
        )

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
        """Points of speed, acceleration and jerk limits: some per span, and the end."""
        edges = np.unique(self.basis.knots)
        spans = edges[:-1, None], np.diff(edges)[:, None]
        return [
            np.append((spans[0] + spans[1] * (np.arange(count) / count)).ravel(), 1.0)
            for count in self.rate_points
        ]
