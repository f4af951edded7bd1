"""Where the curves of `traced_curve` that hold one pose are within position limits, all curves at
once.

A cubic is within the hull of its four control points: most are inside all limits, or outside one,
by that alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.across_curve import LEFT, led
from joulepath.optimizer.kinematics.seven.hermite import hermite_weights
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve, on_curve
from joulepath.optimizer.kinematics.seven.traced_stack import Rows, TracedStack

# parts of a piece that may cross limits, between whose ends it is held against them
PARTS = 8
WEIGHTS = hermite_weights(np.linspace(0.0, 1.0, PARTS + 1))
# steps to where a curve crosses limits, if Newton's method does not find it
CROSSINGS = 16
# longest step of that, and distance [rad] from the cubics within which a curve is
NEAR = 0.05
# rounding of an angle on a limit [rad]
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class _Range:
    """The joints that have limits, the middles (m,) of their ranges and half their widths (m,)
    [rad].
    """

    joints: Rows
    middle: Array
    half: Array

    @classmethod
    def of(cls, q_min: Array, q_max: Array) -> _Range:
        """Of limits (nq,) [rad]; a joint that may turn all around has none."""
        joints = np.flatnonzero(q_max - q_min < 2 * np.pi)
        return cls(joints, ((q_min + q_max) / 2)[joints], ((q_max - q_min) / 2)[joints])

    def excess(self, q: Array) -> Array:
        """How far (n,) [rad] configurations (n, nq) are beyond limits, negative inside."""
        return self.beyond(q[:, self.joints])

    def beyond(self, angles: Array) -> Array:
        """The same (…) of angles (…, m) [rad] of the joints that have limits."""
        away = np.abs(wrapped(angles - self.middle)) - self.half
        return np.asarray(np.maximum.reduce(away, axis=-1))


def within(curves: Sequence[TracedCurve], q_min: Array, q_max: Array) -> list[TracedCurve]:
    """The curves of one pose, cut to where they are within limits (nq,) [rad] but for full turns;
    without those that are nowhere."""
    limits = _Range.of(q_min, q_max)
    if not curves or not len(limits.joints):
        return list(curves)
    cut = _cut(curves, limits)
    return [
        curve if arcs == curve.arcs else curve.cut(arcs)
        for curve, arcs in zip(curves, cut, strict=True)
        if arcs
    ]


def _cut(curves: Sequence[TracedCurve], limits: _Range) -> list[list[tuple[float, float]]]:
    """The arcs of each curve within limits."""
    stack = curves[0].stack
    inside, undecided = _by_hull(stack, limits)
    at, piece = np.zeros(0), np.zeros(0, dtype=np.intp)
    if len(undecided):
        excess = limits.beyond(stack.at_each(undecided, WEIGHTS, limits.joints))
        held = excess <= 0
        row, part = np.nonzero(held[:, 1:] != held[:, :-1])
        piece = undecided[row]
        if len(piece):
            at = _crossings(curves[0], limits, piece, part, excess[row])
    gap = stack.knots[np.minimum(piece + 1, len(inside) - 1)] - stack.knots[piece]
    ends = stack.knots[piece] + at * gap
    # piece by piece, and so curve by curve
    crossed, behind = ends.tolist(), [0, *np.searchsorted(piece, stack.last).tolist()]
    first, last = inside[stack.first].tolist(), inside[stack.last].tolist()
    return [
        _arcs(
            each, crossed[behind[each.row] : behind[each.row + 1]], first[each.row], last[each.row]
        )
        for each in curves
    ]


def _by_hull(stack: TracedStack, limits: _Range) -> tuple[Mask, Rows]:
    """Which nodes (n,) are inside limits, and the rows of those nodes after which the cubic may
    cross one.
    """
    q, tangents = stack.nodes[:, limits.joints], stack.tangents[:, limits.joints]
    own = wrapped(q - limits.middle)
    inside: Mask = np.logical_and.reduce(np.abs(own) <= limits.half, axis=1)
    points = np.empty((4, len(q) - 1, len(limits.joints)))
    points[0] = own[:-1]
    # the other ones without full turns left out
    third = stack.ways[:-1, None] / 3
    points[1], points[3] = points[0] + third * tangents[:-1], points[0] + (q[1:] - q[:-1])
    points[2] = points[3] - third * tangents[1:]
    least, most = np.minimum.reduce(points, axis=0), np.maximum.reduce(points, axis=0)
    low, high = least >= -limits.half, most <= limits.half
    held = np.logical_and.reduce(low & high, axis=1)
    beyond = 2 * np.pi - limits.half
    outside = ((least > limits.half) & (most < beyond)) | (
        (most < -limits.half) & (least > -beyond)
    )
    # of nodes on a limit, rounding may have it that hull and node differ
    both, either = inside[:-1] & inside[1:], inside[:-1] | inside[1:]
    crossing = ~(held & both) & (either | ~np.logical_or.reduce(outside, axis=1))
    crossing[stack.last[:-1]] = False
    return inside, np.flatnonzero(crossing)


def _arcs(
    curve: TracedCurve, ends: list[float], first: bool, last: bool
) -> list[tuple[float, float]]:
    """The arcs of a curve that crosses limits at `ends`; `first`, `last`: whether its own ends are
    inside.
    """
    if not ends:
        return curve.arcs if first else []
    if first:
        ends.insert(0, curve.arcs[0][0])
    if last:
        ends.append(curve.arcs[0][1])
    arcs = list(zip(ends[::2], ends[1::2], strict=True))
    if curve.closed and first and last:
        # the arc goes on behind the curve's own start
        (_, before), (after, _) = arcs[0], arcs[-1]
        arcs = [*arcs[1:-1], (after, before + 2 * np.pi)]
    return arcs


def _crossings(one: TracedCurve, limits: _Range, k: Rows, part: Rows, excess: Array) -> Array:
    """Shares (n,) of the pieces from points k (n,) on at which the curves cross limits, in the
    given parts (n,) of these; the cubics exceed them by so much (n, PARTS + 1) at the ends of all.
    `one` is any curve of the pose."""
    stack, rows = one.stack, np.arange(len(k))
    # a parabola through the ends of the part and of the next one crosses limits next to where the
    # curve does
    low, high = excess[rows, part], excess[rows, part + 1]
    beside = np.where(part < PARTS - 1, part + 2, part - 1)
    chord = low / (low - high)
    bend = (excess[rows, beside] + low + high) / 2 - 1.5 * np.where(beside > part, high, low)
    root = np.minimum(np.maximum(chord - bend * chord * (chord - 1) / (high - low), 0.0), 1.0)
    near = stack.at(k, (part + root) / PARTS)
    q, exact = _on_limits(one, limits, near)
    at = stack.in_line(k, (part + root) / PARTS, q)
    exact &= (at >= 0) & (at <= 1) & (np.maximum.reduce(np.abs(near - q), axis=1) < NEAR)
    rest = np.flatnonzero(~exact)
    if len(rest):
        # what is aimed at is inside, by half of what rounding is given
        at[rest] = _zeros(
            lambda share: limits.excess(on_curve(one, k[rest], share)) + ROUNDING / 2,
            np.array([part[rest], part[rest] + 1]) / PARTS,
            low[rest] <= 0,
        )
    return at


def _on_limits(one: TracedCurve, limits: _Range, q: Array) -> tuple[Array, Mask]:
    """The configurations (n, nq) [rad] of the curves next to q (n, nq) with a joint on its limit,
    and which are found (n,)."""
    n, nq = q.shape
    rows = np.arange(n)
    own = wrapped(q[:, limits.joints] - limits.middle)
    binding = (np.abs(own) - limits.half).argmax(axis=1)
    joint, side = limits.joints[binding], np.sign(own[rows, binding])
    target = q[rows, joint] + side * (limits.half[binding] - ROUNDING / 2) - own[rows, binding]
    along = np.zeros((n, nq))
    along[rows, joint] = 1.0
    q, left = led(one.chain, q, along, target - q[rows, joint], one.T, NEAR)
    return q, (left < LEFT) & (limits.excess(q) <= 0)


def _zeros(beyond: Callable[[Array], Array], share: Array, inside: Mask) -> Array:
    """Where a function of shares (n,) is zero, to ROUNDING, between those given (2, n); inside, if
    that is not found. `inside` (n,): whether it is negative at the first of them."""
    low, high = share
    f_low, f_high = beyond(low), beyond(high)
    found = np.full(len(low), np.nan)
    for _ in range(CROSSINGS):
        # regula falsi after Illinois: the end that stays counts half
        span = np.where(f_high == f_low, 1.0, f_high - f_low)
        at = np.minimum(np.maximum(low - f_low * (high - low) / span, low), high)
        f = beyond(at)
        found = np.where(np.isnan(found) & (np.abs(f) < ROUNDING / 2), at, found)
        if not np.isnan(found).any():
            break
        is_low = (f <= 0) == inside
        f_high = np.where(is_low, f_high / 2, f)
        f_low = np.where(is_low, f, f_low / 2)
        low, high = np.where(is_low, at, low), np.where(is_low, high, at)
    return np.asarray(np.where(np.isnan(found), np.where(inside, low, high), found))
