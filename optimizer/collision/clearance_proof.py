"""Lower bound on the clearance of a motion, proven over continuous time.

**Convex bodies.** For a unit vector n fixed in the frame of the first body of a pair,
sep_n(t) = min n·x over the second body - max n·x over the first never exceeds the signed distance.
Relative to the first body, the acceleration of a point of the second body is at most

    A = Σ_k lever_k (|a_k| + v_k² + 2 |v_k| Σ_{j<k} |v_j|)        over the joints between the two,

with a bound lever_k [m] on its distance from the axis of joint k. Over an interval of length h [s],
n·x(t) is therefore at least its chord minus A h² / 8, and

    distance(t) ≥ min(sep_n(begin), sep_n(end)) - A h² / 8.

The Bernstein coefficients of the spline's polynomial in a knot span bound |v_k| and |a_k|. n is the
normal at one of the two ends of the interval, chosen for the higher bound. The bound holds for
every n: a poor normal only makes it weaker. An interval is halved if its bound is too far below the
least sampled distance.

**Obstacles of many parts.** Such an obstacle has no normal as a whole. The relative speed of a
point of the second body is at most L = Σ_k lever_k |v_k|, and its distance changes no faster, so

    distance(t) ≥ (distance(begin) + distance(end) - L h) / 2.

Once an interval is short enough for L h ≤ `part_travel`, the obstacle is replaced by its parts that
may come within the least sampled distance there; every part is convex. The distances of all other
parts stay above the least sampled distance.

**Distant pairs.** They are removed first. With the distance ball(t) of the enclosing balls of both
bodies, a lower bound on their distance, the distance is at least
(ball(begin) + ball(end) - L h) / 2 throughout the interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.interval_checks import Instants, IntervalChecks
from joulepath.optimizer.collision.interval_motion import IntervalMotion
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.pair_distance import WitnessPoints
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.result.certificate import Clearance


@dataclass(frozen=True)
class ClearanceProofSettings:
    """Accuracy and effort of clearance proofs."""

    gap: float = 1e-4
    """Difference [m] between least sampled distance and bound up to which an interval is done."""
    relative_gap: float = 0.01
    """The same difference relative to the least sampled distance [1]; the larger one counts."""
    least_intervals: int = 32
    """Least number of initial intervals."""
    max_halvings: int = 20
    """Halvings after which the proof ends with the bound reached so far."""
    max_checks: int = 400_000
    """Checks of a pair over an interval after which the proof ends with the bound reached so
    far.
    """
    distance_margin: float = 0.1
    """Excess [m] over the least sampled distance above which the distances of clouds, and of convex
    bodies without a closed form, are not computed.
    """
    part_travel: float = 0.02
    """Travel [m] of a body over an interval up to which the parts of a cloud are checked one by
    one.
    """


CLEARANCE_PROOF = ClearanceProofSettings()


def proven_clearance(model: CollisionModel, spline: Spline) -> Clearance | None:
    """Proven and sampled clearance of a motion, with margins subtracted; None if the model checks
    no pair.
    """
    if not len(model.pairs):
        return None
    clearance = _Proof(model, spline).run()
    if clearance.min_clearance < 0 and clearance.sampled >= CLEARANCE_PROOF.gap:
        # The limits on the effort ended the proof, but less effort may show that the margins hold.
        bound = _Proof(model, spline, CLEARANCE_PROOF.gap).bound()
        clearance = replace(clearance, min_clearance=max(clearance.min_clearance, bound))
    return clearance


def is_proven_clear(model: CollisionModel, spline: Spline) -> bool:
    """Whether the clearance is proven to be at least `gap`, so that `proven_clearance` is not
    negative.

    This takes far fewer intervals than a sharp bound on the clearance. The result is also False if
    the proof would need more than the allowed checks.
    """
    gap = CLEARANCE_PROOF.gap
    return not len(model.pairs) or _Proof(model, spline, gap).bound() >= gap


class _Proof:
    """Proof for one motion.

    `least` [m] is the least distance sampled so far, and `closest` its pair and time [s]. Without
    `required` [m] the proof ends with a bound close to the least distance; otherwise it ends once
    the bound reaches `required`, or a sample is lower.
    """

    def __init__(
        self, model: CollisionModel, spline: Spline, required: float | None = None
    ) -> None:
        self.model, self.geometry, self.spline, self.required = (
            model,
            model.geometry,
            spline,
            required,
        )
        self.motion = IntervalMotion(model, spline)
        self.settings = CLEARANCE_PROOF
        self.least = np.inf
        self.closest = (0, 0.0)

    def run(self) -> Clearance:
        """Proven clearance, with the closest pair."""
        proven = self.bound()
        pair, t = self.closest
        points = self.model.nearest_points(self.motion.instants(np.array([t])).frames, pair)
        return Clearance(proven, self.least, self.model.names(pair), t, points)

    def bound(self) -> float:
        """Lower bound [m]: intervals are halved until all are proven, or the limits on the effort
        are reached.

        The bound is -inf if a sample is lower than `required`.
        """
        instants, distances = self.sampled()
        if self.required is not None and self.least < self.required:
            return -np.inf
        checks = self.initial_checks(instants, distances)
        proven, checked = np.inf, 0
        for level in range(self.settings.max_halvings):
            checked += len(checks.pair)
            bound = self.bounds(instants, checks)
            enough = self.sufficient_bound()
            is_last = (
                level == self.settings.max_halvings - 1
                or checked > self.settings.max_checks
                or self.least < enough
            )
            is_open = np.zeros(len(bound), dtype=bool) if is_last else bound < enough
            proven = min(proven, float(bound[~is_open].min(initial=np.inf)))
            if not is_open.any():
                break
            instants, checks = self.halved(
                instants, self.with_parts(instants, checks[np.flatnonzero(is_open)])
            )
        # Rounding may put an exact bound above the sample.
        return min(proven, self.least)

    def sufficient_bound(self) -> float:
        """Bound [m] at which an interval is done."""
        if self.required is not None:
            return self.required
        settings = self.settings
        return self.least - max(settings.gap, settings.relative_gap * abs(self.least))

    def sampled(self) -> tuple[Instants, Array]:
        """Instants (n,) with all knots, and lower bounds (n, p) [m] on the distances of all pairs
        there.

        The pair with the least bound is sampled at every instant.
        """
        spans = np.unique(self.spline.knots)
        longest = self.spline.duration / self.settings.least_intervals
        parts = [
            np.linspace(a, b, math.ceil((b - a) / longest), endpoint=False)
            for a, b in pairwise(spans)
        ]
        t = np.concatenate([*parts, spans[-1:]])
        instants = self.motion.instants(t)
        # Distances of half-spaces are exact, since no ball encloses a half-space.
        distances = self.model.pair_distances(instants.frames, within=-np.inf).distance
        self.sample_normals(
            instants, np.arange(len(t)), distances.argmin(axis=1), np.full(len(t), -1)
        )
        return instants, distances

    def initial_checks(self, instants: Instants, distances: Array) -> IntervalChecks:
        """Checks of the pairs that may be the closest, over all intervals between n instants.

        `distances` (n, p) [m] are lower bounds at the instants; they are improved in place.
        """
        n, p = distances.shape
        travel = self.motion.travels_between(instants.t)
        is_open = self.may_be_closest(distances, travel)
        instant, pair = np.nonzero(_at_ends(is_open))
        bounds = self.geometry.cover_bounds(instants.frames, instant, pair)
        distances[instant, pair] = np.maximum(distances[instant, pair], bounds)
        is_open &= self.may_be_closest(distances, travel)
        instant, pair = np.nonzero(_at_ends(is_open))
        witness = self.sample_normals(instants, instant, pair, np.full(len(pair), -1))
        row = np.zeros((n, p), dtype=np.intp)
        row[instant, pair] = np.arange(len(pair))
        begin, pair = np.nonzero(is_open)
        part = np.full(len(pair), -1)
        return IntervalChecks(
            pair, part, begin, begin + 1, witness[row[begin, pair]], witness[row[begin + 1, pair]]
        )

    def may_be_closest(self, bounds: Array, travel: Array) -> Mask:
        """Pairs (n - 1, p) that may be nearer than the known or required distance, over the
        intervals between n instants.

        `bounds` (n, p) [m] are lower bounds on their distances at the instants. Over an interval a
        distance changes at most by `travel` (n - 1, p) [m].
        """
        limit = self.least if self.required is None else min(self.least, self.required)
        return np.asarray((bounds[:-1] + bounds[1:] - travel) / 2 < limit)

    def with_parts(self, instants: Instants, checks: IntervalChecks) -> IntervalChecks:
        """The checks, with checks of clouds over short intervals replaced by checks of the parts
        that may be nearest.
        """
        of_cloud = self.model.geometry.is_cloud[checks.pair] & (checks.part < 0)
        if not of_cloud.any():
            return checks
        travel = self.motion.travels(instants, checks)
        chosen = np.flatnonzero(of_cloud & (travel <= self.settings.part_travel))
        whole = checks[chosen]
        # A part beyond this distance at the beginning stays beyond the least sampled distance.
        case, part = self.geometry.near_parts(
            instants.frames, whole.begin, whole.pair, np.maximum(self.least, 0.0) + travel[chosen]
        )
        pair, begin, end = whole.pair[case], whole.begin[case], whole.end[case]
        parts = IntervalChecks(
            pair,
            part,
            begin,
            end,
            self.sample_normals(instants, begin, pair, part),
            self.sample_normals(instants, end, pair, part),
        )
        others = np.flatnonzero(~of_cloud | (travel > self.settings.part_travel))
        return checks[others].joined(parts)

    def halved(self, instants: Instants, checks: IntervalChecks) -> tuple[Instants, IntervalChecks]:
        """Both halves of every interval, with the normals at the middle."""
        intervals, interval = checks.distinct_intervals()
        middle = interval + len(instants.t)
        instants = instants.joined(self.motion.instants(instants.t[intervals].mean(axis=1)))
        witness = self.sample_normals(instants, middle, checks.pair, checks.part)
        first = replace(checks, end=middle, at_end=witness)
        return instants, first.joined(replace(checks, begin=middle, at_begin=witness))

    def sample_normals(
        self, instants: Instants, instant: Indices, pair: Indices, part: Indices
    ) -> WitnessPoints:
        """Distances and normals of pairs (k,) at instants (k,); they update the least sampled
        distance.
        """
        within = max(self.least, 0.0) + self.settings.distance_margin
        witness = self.geometry.witness_points(instants.frames, instant, pair, within, part)
        # For bodies that are farther away, a lower bound is enough.
        witness.distance[np.isinf(witness.distance)] = within
        if len(pair):
            k = int(witness.distance.argmin())
            if witness.distance[k] < self.least:
                self.least = float(witness.distance[k])
                self.closest = int(pair[k]), float(instants.t[instant[k]])
        return witness

    def bounds(self, instants: Instants, checks: IntervalChecks) -> Array:
        """Lower bounds (k,) [m] on the distances over the intervals."""
        of_cloud = self.model.geometry.is_cloud[checks.pair] & (checks.part < 0)
        if of_cloud.any():
            clouds, convex = checks[np.flatnonzero(of_cloud)], checks[np.flatnonzero(~of_cloud)]
            result = np.empty(len(of_cloud))
            result[~of_cloud] = self.convex_bounds(instants, convex)
            travels = self.motion.travels(instants, clouds)
            result[of_cloud] = (clouds.at_begin.distance + clouds.at_end.distance - travels) / 2
            return result
        return self.convex_bounds(instants, checks)

    def convex_bounds(self, instants: Instants, checks: IntervalChecks) -> Array:
        """Lower bounds (k,) [m] on the distances of convex bodies and parts over the intervals."""
        normals = checks.at_begin.normal, checks.at_end.normal
        best = self.geometry.separations(
            instants.frames, checks.begin, checks.end, checks.pair, normals, checks.part
        )
        return best - self.motion.chord_errors(instants, checks)


def _at_ends(intervals: Mask) -> Mask:
    """Pairs (n, p) needed at n instants for pairs of the intervals (n - 1, p) between them."""
    none = np.zeros_like(intervals[:1])
    return np.asarray(np.concatenate([intervals, none]) | np.concatenate([none, intervals]))
