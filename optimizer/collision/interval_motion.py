"""Bounds on the motion of the joints, and of pairs of bodies, over intervals of time."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.interval_checks import Instants, IntervalChecks
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.motion.spline import Spline


class IntervalMotion:
    """Bounds on a spline motion over intervals within its knot spans.

    The symbols A, L, h and lever_k are those of `clearance_proof`.
    """

    def __init__(self, model: CollisionModel, spline: Spline) -> None:
        self._model, self._degree, self._curve = model, spline.degree, spline.curve
        self._levers = model.levers_between

    def instants(self, t: Array) -> Instants:
        """Instants at times (k,) [s]."""
        return Instants(t, self._model.frames(self._curve(t)))

    def travels_between(self, t: Array) -> Array:
        """Greatest relative travel L h (n - 1, p) [m] of all pairs in the intervals between times
        t (n,) [s].
        """
        v, _, h = self.rate_bounds(t[:-1], t[1:])
        return np.asarray((v * h[:, None]) @ self._levers.T)

    def travels(self, instants: Instants, checks: IntervalChecks) -> Array:
        """Greatest travel L h (k,) [m] of a point of the second body relative to the first."""
        intervals, interval = checks.distinct_intervals()
        v, _, h = self.rate_bounds(*instants.t[intervals].T)
        return np.asarray((self._levers[checks.pair] * v[interval]).sum(axis=1) * h[interval])

    def chord_errors(self, instants: Instants, checks: IntervalChecks) -> Array:
        """Greatest deviation A h² / 8 (k,) [m] of n·x from its chord."""
        intervals, interval = checks.distinct_intervals()
        v, a, h = self.rate_bounds(*instants.t[intervals].T)
        before = np.cumsum(v, axis=1) - v
        between = self._model.joints_between[checks.pair]
        # Joints below the first body move both bodies equally, so their speeds are removed from the
        # running sum.
        below = np.where(between, 0.0, v[interval]).cumsum(axis=1)
        lower = before[interval] - np.where(between, below, 0.0)
        v, a = v[interval], a[interval]
        levers = self._levers[checks.pair]
        acceleration = (levers * (a + v**2 + 2 * v * np.maximum(lower, 0.0))).sum(axis=1)
        return np.asarray(acceleration * h[interval] ** 2 / 8)

    def rate_bounds(self, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        """Bounds on |v| [rad/s] and |a| [rad/s²] (k, n) of the joints of the chain over intervals
        (k,) [s], and the lengths (k,) [s] of the intervals.

        Every interval must lie within a knot span.
        """
        h, degree = end - begin, self._degree
        # Polynomial of every interval in powers of the elapsed fraction of the interval.
        rates = self._model.coupling.rates
        powers = np.stack(
            [
                rates(self._curve(begin, d)) * (h**d / math.factorial(d))[:, None]
                for d in range(1, degree + 1)
            ]
        )
        orders = np.arange(1, degree + 1)[:, None, None]
        v = np.abs(_bernstein(powers * orders)).max(axis=0) / h[:, None]
        a = np.abs(_bernstein((powers * orders * (orders - 1))[1:])).max(axis=0) / h[:, None] ** 2
        return v, a, h


def _bernstein(powers: Array) -> Array:
    """Bernstein coefficients (d + 1, …) on [0, 1] of polynomials with coefficients (d + 1, …),
    lowest power first.

    The values of a polynomial lie within the convex hull of its Bernstein coefficients.
    """
    degree, *others = powers.shape
    return (_to_bernstein(degree - 1) @ powers.reshape(degree, -1)).reshape(degree, *others)


@cache
def _to_bernstein(degree: int) -> Array:
    """Matrix (d + 1, d + 1) of the Bernstein coefficients of the powers from 0 to a degree d."""
    return np.array(
        [
            [math.comb(i, k) / math.comb(degree, k) for k in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )
