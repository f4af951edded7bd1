"""Parts of the curves of one pose within position limits, all curves at once.

A cubic lies within the hull of its four control points: this alone shows most cubics to be inside
all limits, or outside one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.across_curve import ACROSS, project_onto_curve
from joulepath.optimizer.kinematics.seven.hermite import hermite_weights
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve, on_curve
from joulepath.optimizer.kinematics.seven.traced_curve_stack import Rows, TracedCurveStack


@dataclass(frozen=True)
class TracedLimitsSettings:
    """Settings of the search for crossings of limits."""

    parts: int = 8
    """Number of parts of an undecided segment whose ends are tested against the limits."""
    divisions: int = 9
    """Largest number of times a segment is divided into parts, in search of parts that cross the
    range of a joint between two tested points: down to 1e-8 of the segment.
    """
    bulge: float = 0.2
    """Largest distance of a cubic from the chord of a part, relative to its largest second
    difference: 1/8 of the second difference at an end, which the linear second differences of 8
    parts exceed by at most a third.
    """
    steps: int = 16
    """Largest number of steps towards a crossing that Newton's method does not find."""
    near: float = 0.05
    """Longest step of Newton's method, and largest joint distance of a curve from its cubics
    [rad].
    """
    rounding: float = 1e-9
    """Angle beyond a limit that is due to rounding [rad]."""


SETTINGS = TracedLimitsSettings()
PART_WEIGHTS = hermite_weights(np.linspace(0.0, 1.0, SETTINGS.parts + 1))


@dataclass(frozen=True, eq=False)
class _JointRanges:
    """Ranges of the joints with limits: middles (m,) and half widths (m,) [rad]."""

    joints: Rows
    middle: Array
    half: Array

    @classmethod
    def of(cls, q_min: Array, q_max: Array) -> _JointRanges:
        """Ranges of limits (nq,) [rad]; a joint that may turn all around has none."""
        joints = np.flatnonzero(q_max - q_min < 2 * np.pi)
        return cls(joints, ((q_min + q_max) / 2)[joints], ((q_max - q_min) / 2)[joints])

    def excess(self, q: Array) -> Array:
        """Largest angle (n,) [rad] of configurations (n, nq) beyond the limits, negative inside."""
        return self.beyond(q[:, self.joints])

    def beyond(self, angles: Array) -> Array:
        """Largest angle (…) [rad] beyond the limits, from angles (…, m) [rad] of the joints with
        limits.
        """
        away = np.abs(wrapped(angles - self.middle)) - self.half
        return np.asarray(np.maximum.reduce(away, axis=-1))

    def may_enter(self, angles: Array) -> Mask:
        """Mask (n, parts) of the parts of cubics that may be within all limits although both of
        their ends are outside, from angles (n, parts + 1, m) [rad] at the ends of the parts.
        """
        bend = np.diff(angles, 2, axis=1)
        bulge = SETTINGS.bulge * np.maximum.reduce(np.abs(bend), axis=1)[:, None]
        own = wrapped(angles - self.middle)
        away = np.abs(own) - self.half
        before, after = own[:, :-1], own[:, 1:]
        across = (before * after < 0) & (np.abs(after - before) < np.pi)
        nearest = np.minimum(away[:, :-1], away[:, 1:]) - bulge
        outside = np.maximum.reduce(away, axis=2) > 0
        passed_by = np.logical_or.reduce((nearest > 0) & ~across, axis=2)
        return np.asarray(outside[:, :-1] & outside[:, 1:] & ~passed_by)


@dataclass(frozen=True, eq=False)
class _Crossed:
    """Parts of segments that cross limits.

    Shares `low` to `low + size` (n,) of the segments after the points k (n,) are divided into equal
    parts; the cubics are beyond the limits by `excess` (n, parts + 1) [rad] at the ends of the
    parts; the limit is crossed in `part` (n,).
    """

    k: Rows
    low: Array
    size: Array
    part: Rows
    excess: Array

    @classmethod
    def in_segments(cls, stack: TracedCurveStack, limits: _JointRanges, k: Rows) -> _Crossed:
        """All parts of the segments after the points k (n,) that cross limits, in order."""
        angles = stack.at_each(k, PART_WEIGHTS, limits.joints)
        low, size, found = np.zeros(len(k)), np.ones(len(k)), []
        for division in range(1, SETTINGS.divisions + 1):
            excess = limits.beyond(angles)
            held = excess <= 0
            row, part = np.nonzero(held[:, 1:] != held[:, :-1])
            found.append((k[row], low[row], size[row], part, excess[row]))
            row, part = np.nonzero(limits.may_enter(angles))
            if not len(row) or division == SETTINGS.divisions:
                break
            size = size[row] / SETTINGS.parts
            k, low = k[row], low[row] + size * part
            shares = low[:, None] + size[:, None] * np.linspace(0.0, 1.0, SETTINGS.parts + 1)
            q = stack.at(k.repeat(shares.shape[1]), shares.ravel())
            angles = q[:, limits.joints].reshape(*shares.shape, -1)
        columns = [np.concatenate(column) for column in zip(*found, strict=True)]
        k, low, size, part, _ = columns
        order = np.lexsort((low + size * part / SETTINGS.parts, k))
        return cls(*(column[order] for column in columns))

    def share(self, root: Array) -> Array:
        """Shares (n,) of the segments at shares `root` (n,) of the crossed parts."""
        return self.low + self.size * (self.part + root) / SETTINGS.parts


def cut_to_limits(curves: Sequence[TracedCurve], q_min: Array, q_max: Array) -> list[TracedCurve]:
    """Curves of one pose, cut to the limits (nq,) [rad] up to full turns; curves wholly outside are
    left out.
    """
    limits = _JointRanges.of(q_min, q_max)
    if not curves or not len(limits.joints):
        return list(curves)
    cut = _cut(curves, limits)
    return [
        curve if arcs == curve.arcs else curve.cut(arcs)
        for curve, arcs in zip(curves, cut, strict=True)
        if arcs
    ]


def _cut(curves: Sequence[TracedCurve], limits: _JointRanges) -> list[list[tuple[float, float]]]:
    """Arcs of each curve within the limits."""
    stack = curves[0].stack
    inside, undecided = _by_hull(stack, limits)
    at, segment = np.zeros(0), np.zeros(0, dtype=np.intp)
    if len(undecided):
        crossed = _Crossed.in_segments(stack, limits, undecided)
        segment = crossed.k
        if len(segment):
            at = _crossings(curves[0], limits, crossed)
    gap = stack.knots[np.minimum(segment + 1, len(inside) - 1)] - stack.knots[segment]
    ends = stack.knots[segment] + at * gap
    # Crossings are sorted by segments, and so by curves.
    places, behind = ends.tolist(), [0, *np.searchsorted(segment, stack.last).tolist()]
    first, last = inside[stack.first].tolist(), inside[stack.last].tolist()
    return [
        _arcs(
            each, places[behind[each.row] : behind[each.row + 1]], first[each.row], last[each.row]
        )
        for each in curves
    ]


def _by_hull(stack: TracedCurveStack, limits: _JointRanges) -> tuple[Mask, Rows]:
    """Mask (n,) of the nodes inside the limits, and rows of the nodes that begin undecided
    segments.
    """
    q, tangents = stack.nodes[:, limits.joints], stack.tangents[:, limits.joints]
    own = wrapped(q - limits.middle)
    inside: Mask = np.logical_and.reduce(np.abs(own) <= limits.half, axis=1)
    points = np.empty((4, len(q) - 1, len(limits.joints)))
    points[0] = own[:-1]
    # The other control points follow without jumps by full turns.
    third = stack.segment_lengths[:-1, None] / 3
    points[1], points[3] = points[0] + third * tangents[:-1], points[0] + (q[1:] - q[:-1])
    points[2] = points[3] - third * tangents[1:]
    least, most = np.minimum.reduce(points, axis=0), np.maximum.reduce(points, axis=0)
    low, high = least >= -limits.half, most <= limits.half
    held = np.logical_and.reduce(low & high, axis=1)
    beyond = 2 * np.pi - limits.half
    outside = ((least > limits.half) & (most < beyond)) | (
        (most < -limits.half) & (least > -beyond)
    )
    # At nodes on a limit, rounding may make hull and node disagree.
    both, either = inside[:-1] & inside[1:], inside[:-1] | inside[1:]
    crossing = ~(held & both) & (either | ~np.logical_or.reduce(outside, axis=1))
    crossing[stack.last[:-1]] = False
    return inside, np.flatnonzero(crossing)


def _arcs(
    curve: TracedCurve, ends: list[float], first: bool, last: bool
) -> list[tuple[float, float]]:
    """Arcs of a curve that crosses limits at `ends`.

    `first` and `last` tell whether the ends of the curve itself are inside.
    """
    if not ends:
        return curve.arcs if first else []
    if first:
        ends.insert(0, curve.arcs[0][0])
    if last:
        ends.append(curve.arcs[0][1])
    arcs = list(zip(ends[::2], ends[1::2], strict=True))
    if curve.closed and first and last:
        # The last arc continues beyond the start of the curve.
        (_, before), (after, _) = arcs[0], arcs[-1]
        arcs = [*arcs[1:-1], (after, before + 2 * np.pi)]
    return arcs


def _crossings(one: TracedCurve, limits: _JointRanges, crossed: _Crossed) -> Array:
    """Shares (n,) of segments at which the curves of the pose of `one` cross limits."""
    k, part, rows = crossed.k, crossed.part, np.arange(len(crossed.k))
    # A parabola through the ends of the part and of an adjacent one crosses the limit near the
    # crossing of the curve.
    low, high = crossed.excess[rows, part], crossed.excess[rows, part + 1]
    beside = np.where(part < SETTINGS.parts - 1, part + 2, part - 1)
    chord = low / (low - high)
    bend = (crossed.excess[rows, beside] + low + high) / 2
    bend -= 1.5 * np.where(beside > part, high, low)
    root = np.minimum(np.maximum(chord - bend * chord * (chord - 1) / (high - low), 0.0), 1.0)
    near = one.stack.at(k, crossed.share(root))
    q, exact = _on_limits(one, limits, near)
    at = one.stack.shares_across(k, crossed.share(root), q)
    exact &= (at >= 0) & (at <= 1) & (np.maximum.reduce(np.abs(near - q), axis=1) < SETTINGS.near)
    rest = np.flatnonzero(~exact)
    if len(rest):
        brackets = np.array([crossed.share(np.zeros(len(k))), crossed.share(np.ones(len(k)))])
        # The target is inside the limits by half of the rounding tolerance.
        at[rest] = _zeros(
            lambda share: limits.excess(on_curve(one, k[rest], share)) + SETTINGS.rounding / 2,
            brackets[:, rest],
            low[rest] <= 0,
        )
    return at


def _on_limits(one: TracedCurve, limits: _JointRanges, q: Array) -> tuple[Array, Mask]:
    """Configurations (n, nq) [rad] of the curves next to q (n, nq) with a joint on its limit, and a
    mask (n,) of those found.
    """
    n, nq = q.shape
    rows = np.arange(n)
    own = wrapped(q[:, limits.joints] - limits.middle)
    binding = (np.abs(own) - limits.half).argmax(axis=1)
    joint, side = limits.joints[binding], np.sign(own[rows, binding])
    target = (
        q[rows, joint] + side * (limits.half[binding] - SETTINGS.rounding / 2) - own[rows, binding]
    )
    along = np.zeros((n, nq))
    along[rows, joint] = 1.0
    q, left = project_onto_curve(one.chain, q, along, target - q[rows, joint], one.T, SETTINGS.near)
    return q, (left < ACROSS.tolerance) & (limits.excess(q) <= 0)


def _zeros(beyond: Callable[[Array], Array], share: Array, inside: Mask) -> Array:
    """Zeros (n,) of a function of shares (n,) between the given ones (2, n), by the Illinois
    method.

    Args:
        beyond: function, negative inside the limits.
        share: brackets of the zeros, shape (2, n).
        inside: whether the first end of each bracket is inside, shape (n,).

    Returns:
        The zeros, to half of the rounding tolerance, or the inner ends of the brackets if the
        search fails.
    """
    low, high = share
    f_low, f_high = beyond(low), beyond(high)
    found = np.full(len(low), np.nan)
    for _ in range(SETTINGS.steps):
        # Illinois variant of the regula falsi: the value at an end that stays is halved.
        span = np.where(f_high == f_low, 1.0, f_high - f_low)
        at = np.minimum(np.maximum(low - f_low * (high - low) / span, low), high)
        f = beyond(at)
        found = np.where(np.isnan(found) & (np.abs(f) < SETTINGS.rounding / 2), at, found)
        if not np.isnan(found).any():
            break
        is_low = (f <= 0) == inside
        f_high = np.where(is_low, f_high / 2, f)
        f_low = np.where(is_low, f, f_low / 2)
        low, high = np.where(is_low, at, low), np.where(is_low, high, at)
    return np.asarray(np.where(np.isnan(found), np.where(inside, low, high), found))
