"""Lower bound on the clearance of a motion, proven over continuous time.

For a unit vector n fixed in the frame of a pair's first body, sep_n(t) = min n·x over the second
body - max n·x over the first never exceeds the signed distance. Relative to the first body, the
acceleration of a point of the second body is at most

    A = Σ_k lever_k (|a_k| + v_k² + 2 |v_k| Σ_{j<k} |v_j|)        over the joints between the two,

where lever_k [m] bounds its distance from the axis of joint k. Over an interval of length h [s],
n·x(t) is therefore at least its chord less A h² / 8, and

    distance(t) ≥ min(sep_n(begin), sep_n(end)) - A h² / 8.

The Bernstein coefficients of the spline's polynomial in a knot span bound |v_k| and |a_k|. n is the
normal at one of the two ends of the interval, whichever gives the higher bound. The bound holds for
every n: a poor normal makes it weaker, not wrong. An interval whose bound is too far below the
least sampled distance is halved.

An obstacle of many parts has no such normal as a whole. Its distance changes no faster than L
(below), so that

    distance(t) ≥ (distance(begin) + distance(end) - L h) / 2.

Once an interval is so short that L h ≤ EXPANDED, the parts that can come within the least sampled
distance there take the place of the obstacle: each is convex. The distance of all others stays
above the least sampled one.

Pairs that are far apart are removed first: the relative speed of a point of the second body is at
most L = Σ_k lever_k |v_k|. If ball(t) bounds the distance from below by that of the bodies'
enclosing balls, the distance is at least (ball(begin) + ball(end) - L h) / 2 throughout the
interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.pair_distance import WitnessPoints
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.result.certificate import Clearance

# an interval is done if its bound is this near to the least sampled distance: absolutely [m], or
# relative to it
GAP, RELATIVE_GAP = 1e-4, 0.01
LEAST_INTERVALS = 32
# the proof ends with the bound reached so far after this many halvings, or checks of a pair over an
# interval
MOST_LEVELS, MOST_CHECKS = 20, 400_000
# distances of whole clouds are not computed if they are greater than the least sampled one by this
# [m]
BEYOND = 0.1
# travel [m] of a body over an interval below which the parts of a cloud are checked one by one
EXPANDED = 0.02


@dataclass(frozen=True)
class _Instants:
    """Times t (k,) [s] and the link frames there (k, nq + 1, 4, 4)."""

    t: Array
    frames: Array

    def with_more(self, more: _Instants) -> _Instants:
        return _Instants(
            np.concatenate([self.t, more.t]), np.concatenate([self.frames, more.frames])
        )


@dataclass(frozen=True)
class _Checks:
    """Pairs over intervals (k,): indices of the pair and of the instants at both ends, and the
    distances there.

    `part` (k,) is the part of the first body if that is a patch of a cloud, -1 for all of its
    parts.
    """

    pair: Indices
    part: Indices
    begin: Indices
    end: Indices
    at_begin: WitnessPoints
    at_end: WitnessPoints

    def __getitem__(self, chosen: Indices) -> _Checks:
        return _Checks(
            self.pair[chosen],
            self.part[chosen],
            self.begin[chosen],
            self.end[chosen],
            self.at_begin[chosen],
            self.at_end[chosen],
        )

    def with_more(self, more: _Checks) -> _Checks:
        return _Checks(
            np.concatenate([self.pair, more.pair]),
            np.concatenate([self.part, more.part]),
            np.concatenate([self.begin, more.begin]),
            np.concatenate([self.end, more.end]),
            self.at_begin.with_more(more.at_begin),
            self.at_end.with_more(more.at_end),
        )

    def distinct_intervals(self) -> tuple[Indices, Indices]:
        """The different intervals (m, 2), as indices of instants, and which of them each check (k,)
        is about.
        """
        # as one number each: rows of two are sorted much more slowly
        base = int(self.end.max(initial=0)) + 1
        codes, which = np.unique(self.begin * base + self.end, return_inverse=True)
        return np.column_stack(np.divmod(codes, base)), which


def proven_clearance(model: CollisionModel, spline: Spline) -> Clearance | None:
    """Proven and sampled clearance of a motion, margins subtracted; None if the model checks no
    pair.
    """
    if not len(model.pairs):
        return None
    found = _Proof(model, spline).run()
    if found.min_clearance < 0 and found.sampled >= GAP:
        # the limits on the effort ended it: less effort shows that the margins hold
        found = replace(
            found, min_clearance=max(found.min_clearance, _Proof(model, spline, wanted=GAP).bound())
        )
    return found


def is_proven_clear(model: CollisionModel, spline: Spline) -> bool:
    """Whether the clearance is proven to be GAP or more: `proven_clearance` is then not negative.

    It takes far fewer intervals than to know how great the clearance is. False may also mean that
    more are needed.
    """
    return not len(model.pairs) or _Proof(model, spline, wanted=GAP).bound() >= GAP


class _Proof:
    """The proof for one motion. `least` [m] is the least distance sampled so far, of `closest`:
    pair and time [s].

    Without `wanted` [m] the bound comes near to the least distance; else the proof ends once the
    bound is as high, or a sample is lower.
    """

    def __init__(self, model: CollisionModel, spline: Spline, wanted: float | None = None) -> None:
        self.model, self.geometry, self.spline, self.wanted = model, model.geometry, spline, wanted
        self.curve = spline.curve
        self.levers = model.levers_between
        self.least = np.inf
        self.closest = (0, 0.0)

    def run(self) -> Clearance:
        """The proven clearance, with what is closest."""
        proven = self.bound()
        pair, t = self.closest
        points = self.model.nearest_points(self.instants(np.array([t])).frames, pair)
        return Clearance(proven, self.least, self.model.names(pair), t, points)

    def bound(self) -> float:
        """Lower bound [m]: halves intervals until all are proven, or the limits on the effort are
        reached.

        -inf if a sample is lower than what is `wanted`.
        """
        instants, distances = self.sampled()
        if self.wanted is not None and self.least < self.wanted:
            return -np.inf
        checks = self.initial_checks(instants, distances)
        proven, checked = np.inf, 0
        for level in range(MOST_LEVELS):
            checked += len(checks.pair)
            bound = self.bounds(instants, checks)
            enough = (
                self.least - max(GAP, RELATIVE_GAP * abs(self.least))
                if self.wanted is None
                else self.wanted
            )
            is_last = level == MOST_LEVELS - 1 or checked > MOST_CHECKS or self.least < enough
            is_open = np.zeros(len(bound), dtype=bool) if is_last else bound < enough
            proven = min(proven, float(bound[~is_open].min(initial=np.inf)))
            if not is_open.any():
                break
            instants, checks = self.halved(
                instants, self.expanded(instants, checks[np.flatnonzero(is_open)])
            )
        # rounding may put a bound that is exact above the sample
        return min(proven, self.least)

    def sampled(self) -> tuple[_Instants, Array]:
        """Instants (n,) with all knots, and lower bounds (n, p) [m] on the distances of all pairs
        there.

        The pair of the least bound is sampled at each of them.
        """
        spans = np.unique(self.spline.knots)
        longest = self.spline.duration / LEAST_INTERVALS
        parts = [
            np.linspace(a, b, math.ceil((b - a) / longest), endpoint=False)
            for a, b in pairwise(spans)
        ]
        t = np.concatenate([*parts, spans[-1:]])
        instants = self.instants(t)
        # those of half-spaces, which no ball encloses, are exact
        distances = self.model.pair_distances(instants.frames, within=-np.inf).distance
        self.sample_normals(
            instants, np.arange(len(t)), distances.argmin(axis=1), np.full(len(t), -1)
        )
        return instants, distances

    def initial_checks(self, instants: _Instants, distances: Array) -> _Checks:
        """The pairs that may be the closest between two instants, of all intervals; with lower
        bounds `distances`.
        """
        n, p = distances.shape
        v, _, h = self.rate_bounds(instants.t[:-1], instants.t[1:])
        travel = (v * h[:, None]) @ self.levers.T
        is_open = self.may_be_closest(distances, travel)
        instant, pair = np.nonzero(_at_ends(is_open))
        beads = self.geometry.bead_bounds(instants.frames, instant, pair)
        distances[instant, pair] = np.maximum(distances[instant, pair], beads)
        is_open &= self.may_be_closest(distances, travel)
        instant, pair = np.nonzero(_at_ends(is_open))
        found = self.sample_normals(instants, instant, pair, np.full(len(pair), -1))
        row = np.zeros((n, p), dtype=np.intp)
        row[instant, pair] = np.arange(len(pair))
        begin, pair = np.nonzero(is_open)
        part = np.full(len(pair), -1)
        return _Checks(
            pair, part, begin, begin + 1, found[row[begin, pair]], found[row[begin + 1, pair]]
        )

    def may_be_closest(self, bounds: Array, travel: Array) -> Mask:
        """Which pairs (n - 1, p) may be nearer than what is known or wanted over the intervals
        between n instants.

        `bounds` (n, p) [m] are lower bounds on their distances at the instants, which change over
        an interval by no more than the `travel` (n - 1, p) [m].
        """
        limit = self.least if self.wanted is None else min(self.least, self.wanted)
        return np.asarray((bounds[:-1] + bounds[1:] - travel) / 2 < limit)

    def expanded(self, instants: _Instants, checks: _Checks) -> _Checks:
        """The checks, with those of clouds over short intervals replaced by checks of the parts
        that may be nearest.
        """
        of_cloud = self.model.geometry.is_cloud[checks.pair] & (checks.part < 0)
        if not of_cloud.any():
            return checks
        travel = self.travels(instants, checks)
        chosen = np.flatnonzero(of_cloud & (travel <= EXPANDED))
        whole = checks[chosen]
        # a part that is farther away at the begin stays farther away than the least sampled
        # distance
        case, part = self.geometry.near_parts(
            instants.frames, whole.begin, whole.pair, np.maximum(self.least, 0.0) + travel[chosen]
        )
        pair, begin, end = whole.pair[case], whole.begin[case], whole.end[case]
        parts = _Checks(
            pair,
            part,
            begin,
            end,
            self.sample_normals(instants, begin, pair, part),
            self.sample_normals(instants, end, pair, part),
        )
        return checks[np.flatnonzero(~of_cloud | (travel > EXPANDED))].with_more(parts)

    def halved(self, instants: _Instants, checks: _Checks) -> tuple[_Instants, _Checks]:
        """Both halves of every interval, with the normals at the middle."""
        intervals, which = checks.distinct_intervals()
        middle = which + len(instants.t)
        instants = instants.with_more(self.instants(instants.t[intervals].mean(axis=1)))
        found = self.sample_normals(instants, middle, checks.pair, checks.part)
        first = replace(checks, end=middle, at_end=found)
        return instants, first.with_more(replace(checks, begin=middle, at_begin=found))

    def sample_normals(
        self, instants: _Instants, instant: Indices, pair: Indices, part: Indices
    ) -> WitnessPoints:
        """Distances and normals of pairs (k,) at instants (k,). They update the least sampled
        distance.
        """
        within = max(self.least, 0.0) + BEYOND
        found = self.geometry.witness_points(instants.frames, instant, pair, within, part)
        # patches of a cloud that are farther away: a lower bound is enough
        found.distance[np.isinf(found.distance)] = within
        if len(pair):
            k = int(found.distance.argmin())
            if found.distance[k] < self.least:
                self.least, self.closest = (
                    float(found.distance[k]),
                    (int(pair[k]), float(instants.t[instant[k]])),
                )
        return found

    def bounds(self, instants: _Instants, checks: _Checks) -> Array:
        """Lower bounds (k,) [m] on the distances over the intervals."""
        of_cloud = self.model.geometry.is_cloud[checks.pair] & (checks.part < 0)
        if of_cloud.any():
            whole, convex = checks[np.flatnonzero(of_cloud)], checks[np.flatnonzero(~of_cloud)]
            result = np.empty(len(of_cloud))
            result[~of_cloud] = self.convex_bounds(instants, convex)
            result[of_cloud] = (
                whole.at_begin.distance + whole.at_end.distance - self.travels(instants, whole)
            ) / 2
            return result
        return self.convex_bounds(instants, checks)

    def convex_bounds(self, instants: _Instants, checks: _Checks) -> Array:
        """The same for convex bodies and parts."""
        normals = checks.at_begin.normal, checks.at_end.normal
        best = self.geometry.separations(
            instants.frames, checks.begin, checks.end, checks.pair, normals, checks.part
        )
        return best - self.chord_errors(instants, checks)

    def travels(self, instants: _Instants, checks: _Checks) -> Array:
        """L h (k,) [m]: how far a point of the second body moves at most, relative to the first."""
        intervals, which = checks.distinct_intervals()
        v, _, h = self.rate_bounds(*instants.t[intervals].T)
        return np.asarray((self.levers[checks.pair] * v[which]).sum(axis=1) * h[which])

    def chord_errors(self, instants: _Instants, checks: _Checks) -> Array:
        """A h² / 8 (k,) [m]."""
        intervals, which = checks.distinct_intervals()
        v, a, h = self.rate_bounds(*instants.t[intervals].T)
        before = np.cumsum(v, axis=1) - v
        between = self.model.joints_between[checks.pair]
        # joints below the first body move both bodies alike: their speeds are taken out of the
        # running sum
        below = np.where(between, 0.0, v[which]).cumsum(axis=1)
        lower = before[which] - np.where(between, below, 0.0)
        v, a = v[which], a[which]
        acceleration = (self.levers[checks.pair] * (a + v**2 + 2 * v * np.maximum(lower, 0.0))).sum(
            axis=1
        )
        return np.asarray(acceleration * h[which] ** 2 / 8)

    def rate_bounds(self, begin: Array, end: Array) -> tuple[Array, Array, Array]:
        """Bounds on |v| [rad/s] and |a| [rad/s²] (k, nq) over intervals (k,) [s], and the
        intervals' lengths (k,) [s].

        Each interval must lie within a knot span.
        """
        h, degree = end - begin, self.spline.degree
        # the polynomial of each interval in powers of the elapsed fraction of it
        powers = np.stack(
            [
                self.curve(begin, d) * (h**d / math.factorial(d))[:, None]
                for d in range(1, degree + 1)
            ]
        )
        orders = np.arange(1, degree + 1)[:, None, None]
        v = np.abs(_bernstein(powers * orders)).max(axis=0) / h[:, None]
        a = np.abs(_bernstein((powers * orders * (orders - 1))[1:])).max(axis=0) / h[:, None] ** 2
        return v, a, h

    def instants(self, t: Array) -> _Instants:
        """Link frames at times (k,) [s]."""
        return _Instants(t, self.model.frames(self.curve(t)))


def _at_ends(intervals: Mask) -> Mask:
    """Which pairs (n, p) are needed at n instants for those of the intervals (n - 1, p) between
    them.
    """
    none = np.zeros_like(intervals[:1])
    return np.asarray(np.concatenate([intervals, none]) | np.concatenate([none, intervals]))


def _bernstein(powers: Array) -> Array:
    """Bernstein coefficients (d + 1, …) on [0, 1] of polynomials with coefficients (d + 1, …),
    lowest power first.

    The values of a polynomial lie within the convex hull of its Bernstein coefficients.
    """
    degree = len(powers) - 1
    matrix = np.array(
        [
            [math.comb(i, k) / math.comb(degree, k) for k in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )
    return np.tensordot(matrix, powers, axes=1)
