"""How far a motion keeps away from everything, proven over continuous time.

For a fixed unit normal n in the frame of a pair's first body, sep_n(t) = min n·x over the second less max n·x over the
first is never more than the signed distance. Every point of the second body moves, seen from the first, with an
acceleration of at most

    A = Σ_k lever_k (|a_k| + v_k² + 2 |v_k| Σ_{j<k} |v_j|)        over the joints between the two,

so that n·x(t) lies above its chord over an interval of length h less A h² / 8. Hence over the interval

    distance(t) ≥ min(sep_n(begin), sep_n(end)) - A h² / 8.

|v_k| and |a_k| are bounded by the Bernstein coefficients of the polynomials that they are within a knot span. n is the
normal at either end, whichever gives more; a wrong n could only weaken the bound. Intervals whose bound is not near
enough to the least distance sampled are halved.

Before all that, pairs far apart are done with: no point of the second body passes the first faster than
L = Σ_k lever_k |v_k|, so that a distance bounded by that of the bodies' balls at both ends of an interval is at least
(ball(begin) + ball(end) - L h) / 2 all along it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline

from models.robot import Array
from optimizer.collision.bodies import Indices
from optimizer.collision.model import CollisionModel
from optimizer.solution import Clearance
from optimizer.trajectories.spline import Spline

# the proven bound comes this near to the least distance sampled: absolutely [m], or as a share of it
GAP, RELATIVE_GAP = 1e-4, 0.01
LEAST_INTERVALS = 32
# halvings of an interval, and pairs at intervals looked at, before the proof is left where it stands
MOST_LEVELS, MOST_CHECKS = 20, 400_000


@dataclass(frozen=True)
class _Times:
    """Instants looked at: when (k,) [s] and where everything is."""

    t: Array
    frames: Array

    def with_more(self, more: _Times) -> _Times:
        return _Times(np.concatenate([self.t, more.t]), np.concatenate([self.frames, more.frames]))


@dataclass(frozen=True)
class _Checks:
    """Pairs over intervals: numbers of the pair and of the instants at both ends, and the normals there (k, 3)."""

    pair: Indices
    begin: Indices
    end: Indices
    normals: tuple[Array, Array]

    def __getitem__(self, chosen: Indices) -> _Checks:
        first, second = self.normals
        return _Checks(self.pair[chosen], self.begin[chosen], self.end[chosen], (first[chosen], second[chosen]))


def clearance(model: CollisionModel, spline: Spline) -> Clearance | None:
    """The least distance over the motion, less the margins asked for; None where nothing is compared with anything."""
    return _Proof(model, spline).run() if len(model.pairs) else None


class _Proof:
    """One motion being proven."""

    def __init__(self, model: CollisionModel, spline: Spline) -> None:
        self.model, self.spline = model, spline
        self.curve = BSpline(spline.knots, spline.control_points, spline.degree)
        self.levers = model.levers() * model.between
        self.least = np.inf
        self.where = (0, 0.0)

    def run(self) -> Clearance:
        """Halves intervals until every one is proven, or the effort is spent."""
        times, checks = self.outset()
        proven, looked = np.inf, 0
        for level in range(MOST_LEVELS):
            looked += len(checks.pair)
            bound = self.bounds(times, checks)
            enough = self.least - max(GAP, RELATIVE_GAP * abs(self.least))
            if level == MOST_LEVELS - 1 or looked > MOST_CHECKS:
                open_ = np.empty(0, dtype=np.intp)
            else:
                open_ = np.flatnonzero(bound < enough)
            closed = np.ones(len(bound), dtype=bool)
            closed[open_] = False
            proven = min(proven, float(bound[closed].min(initial=np.inf)))
            if not open_.size:
                break
            times, checks = self.halved(times, checks[open_])
        # never above what was sampled, where a bound is exact but for rounding
        pair, t = self.where
        return Clearance(min(proven, self.least), self.least, self.model.names(pair), t)

    def outset(self) -> tuple[_Times, _Checks]:
        """Intervals that each lie within a knot span, and the pairs that may be the nearest there."""
        spans = np.unique(self.spline.knots)
        share = self.spline.duration / LEAST_INTERVALS
        parts = [np.linspace(a, b, math.ceil((b - a) / share), endpoint=False) for a, b in pairwise(spans)]
        t = np.concatenate([*parts, spans[-1:]])
        times = self.at(t)
        n, p = len(t), len(self.model.pairs)
        balls = self.model.pair_distances(times.frames, within=-np.inf).distance
        self.sampled(times, np.arange(n), balls.argmin(axis=1))
        v, _, h = self.rates(t[:-1], t[1:])
        passed = (v * h[:, None]) @ self.levers.T
        open_ = (balls[:-1] + balls[1:] - passed) / 2 < self.least
        looked_at = np.zeros((n, p), dtype=bool)
        looked_at[:-1] |= open_
        looked_at[1:] |= open_
        instant, pair = np.nonzero(looked_at)
        normals = np.zeros((n, p, 3))
        normals[instant, pair] = self.sampled(times, instant, pair)
        begin, pair = np.nonzero(open_)
        return times, _Checks(pair, begin, begin + 1, (normals[begin, pair], normals[begin + 1, pair]))

    def halved(self, times: _Times, checks: _Checks) -> tuple[_Times, _Checks]:
        """Both halves of every interval, with the normals in the middle."""
        intervals, which = np.unique(np.column_stack([checks.begin, checks.end]), axis=0, return_inverse=True)
        middles = self.at(times.t[intervals].mean(axis=1))
        middle = which.ravel() + len(times.t)
        times = times.with_more(middles)
        normal = self.sampled(times, middle, checks.pair)
        first, second = checks.normals
        return times, _Checks(
            np.concatenate([checks.pair, checks.pair]),
            np.concatenate([checks.begin, middle]),
            np.concatenate([middle, checks.end]),
            (np.concatenate([first, normal]), np.concatenate([normal, second])),
        )

    def sampled(self, times: _Times, instant: Indices, pair: Indices) -> Array:
        """Normals (k, 3) of pairs at instants, whose distances count as samples."""
        found = self.model.nearest(times.frames, instant, pair)
        if len(pair):
            k = int(found.distance.argmin())
            if found.distance[k] < self.least:
                self.least, self.where = float(found.distance[k]), (int(pair[k]), float(times.t[instant[k]]))
        return found.normal

    def bounds(self, times: _Times, checks: _Checks) -> Array:
        """Lower bounds (k,) [m] on the distances over the intervals."""
        begin, end, pair = checks.begin, checks.end, checks.pair
        sag = self.sag(times, checks)
        first = self.model.pairs[pair, 0]
        link = self.model.links[first]
        R_begin, R_end = times.frames[begin, link][:, :3, :3], times.frames[end, link][:, :3, :3]
        best = np.full(len(pair), -np.inf)
        for normal, R_from in zip(checks.normals, (R_begin, R_end), strict=True):
            fixed = np.einsum("kij,ki->kj", R_from, normal)
            least = np.minimum(
                *(
                    self.model.separation(times.frames, at, pair, np.einsum("kij,kj->ki", R_to, fixed))
                    for at, R_to in ((begin, R_begin), (end, R_end))
                )
            )
            best = np.maximum(best, least)
        return best - sag

    def sag(self, times: _Times, checks: _Checks) -> Array:
        """A h² / 8 (k,) [m]."""
        intervals, which = np.unique(np.column_stack([checks.begin, checks.end]), axis=0, return_inverse=True)
        v, a, h = self.rates(*times.t[intervals].T)
        before = np.cumsum(v, axis=1) - v
        between = self.model.between[checks.pair]
        which = which.ravel()
        # joints below the first body do not count: their speeds are taken out of the running sum
        below = np.where(between, 0.0, v[which]).cumsum(axis=1)
        lower = before[which] - np.where(between, below, 0.0)
        v, a = v[which], a[which]
        acceleration = (self.levers[checks.pair] * (a + v**2 + 2 * v * np.maximum(lower, 0.0))).sum(axis=1)
        return np.asarray(acceleration * h[which] ** 2 / 8)

    def rates(self, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        """Bounds on |v| and |a| (k, nq) over intervals from begin to end (k,) [s], and their lengths (k,) [s]."""
        h, degree = end - begin, self.spline.degree
        # the polynomial of each interval in powers of the share of it that has passed
        powers = np.stack([self.curve(begin, d) * (h**d / math.factorial(d))[:, None] for d in range(1, degree + 1)])
        orders = np.arange(1, degree + 1)[:, None, None]
        v = np.abs(_bernstein(powers * orders)).max(axis=0) / h[:, None]
        a = np.abs(_bernstein((powers * orders * (orders - 1))[1:])).max(axis=0) / h[:, None] ** 2
        return v, a, h

    def at(self, t: Array) -> _Times:
        """Where everything is at times (k,)."""
        return _Times(t, self.model.frames(self.curve(t)))


def _bernstein(powers: Array) -> Array:
    """Bernstein coefficients (d + 1, …) on [0, 1] of polynomials given by powers (d + 1, …): their hull holds them."""
    degree = len(powers) - 1
    matrix = np.array([[math.comb(i, k) / math.comb(degree, k) for k in range(degree + 1)] for i in range(degree + 1)])
    return np.tensordot(matrix, powers, axes=1)
