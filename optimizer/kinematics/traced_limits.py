"""Where the curves of `traced_curve` that hold one pose are within position limits, all curves at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from models.robot import Array, Mask
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.hermite import hermite
from optimizer.kinematics.traced_curve import TracedCurve

# parts of each piece between whose ends a curve is held against limits, and steps that find where it crosses them
PARTS, CROSSINGS = 4, 16
# steps of the curve itself from where its cubics cross, and the difference of shares for their slope
FROM_CUBICS, STEP = 5, 1e-5
# rounding of an angle on a limit [rad]
ROUNDING = 1e-9


def within(curves: Sequence[TracedCurve], q_min: Array, q_max: Array) -> list[TracedCurve]:
    """The curves of one pose, cut to where they are within limits (nq,) [rad] but for full turns; without those that
    are nowhere."""
    points = [curve for curve in curves if len(curve.knots) == 1]
    outside = {id(each) for each in points if _excess(each.nodes, q_min, q_max)[0] > 0}
    lines = [curve for curve in curves if len(curve.knots) > 1]
    cut = dict(zip(map(id, lines), _cut(lines, q_min, q_max), strict=True)) if lines else {}
    kept = ((curve, cut.get(id(curve), curve.arcs)) for curve in curves if id(curve) not in outside)
    return [curve if arcs == curve.arcs else replace(curve, arcs=arcs) for curve, arcs in kept if arcs]


@dataclass(frozen=True, eq=False)
class _Pieces:
    """The cubics (m,) between the nodes of curves: ends and slopes (m, nq), and the parameters `knots` (2, m) there."""

    q0: Array
    q1: Array
    slope0: Array
    slope1: Array
    knots: Array

    @classmethod
    def of(cls, curves: Sequence[TracedCurve]) -> _Pieces:
        """Those of all curves, one curve after the other."""
        q0, q1, t0, t1 = (
            np.vstack([getattr(curve, name)[part] for curve in curves])
            for name in ("nodes", "tangents")
            for part in (slice(None, -1), slice(1, None))
        )
        way = np.linalg.norm(q1 - q0, axis=1)[:, None]
        knots = np.hstack([np.stack([curve.knots[:-1], curve.knots[1:]]) for curve in curves])
        return cls(q0, q1, way * t0, way * t1, knots)

    def at(self, k: NDArray[np.intp], share: Array) -> Array:
        """Points (n, nq) [rad] at shares (n,) of pieces k (n,)."""
        return hermite(share, self.q0[k], self.q1[k], self.slope0[k], self.slope1[k])


def _cut(curves: Sequence[TracedCurve], q_min: Array, q_max: Array) -> list[list[tuple[float, float]]]:
    """The arcs of each curve within limits."""
    pieces = _Pieces.of(curves)
    count = len(pieces.q0)
    share = np.linspace(0.0, 1.0, PARTS + 1)
    sampled = pieces.at(np.repeat(np.arange(count), PARTS + 1), np.tile(share, count))
    inside = (_excess(sampled, q_min, q_max) <= 0).reshape(count, PARTS + 1)
    piece, part = np.nonzero(inside[:, 1:] != inside[:, :-1])
    ends = np.zeros(0)
    if len(piece):
        at = _crossings(curves[0], pieces, piece, share[[part, part + 1]], inside[piece, part], q_min, q_max)
        low, high = pieces.knots[:, piece]
        ends = low + at * (high - low)
    last = np.cumsum([len(curve.knots) - 1 for curve in curves])
    crossed = np.split(ends, np.searchsorted(piece, last)[:-1])
    starts_inside, ends_inside = inside[np.append(0, last[:-1]), 0], inside[last - 1, -1]
    each = zip(curves, crossed, starts_inside.tolist(), ends_inside.tolist(), strict=True)
    return [_arcs(curve, own.tolist(), first, final) for curve, own, first, final in each]


def _arcs(curve: TracedCurve, ends: list[float], first: bool, last: bool) -> list[tuple[float, float]]:
    """The arcs of a curve that crosses limits at `ends`; `first`, `last`: whether its own ends are inside."""
    if not ends:
        return curve.arcs if first else []
    if first:
        ends.insert(0, float(curve.knots[0]))
    if last:
        ends.append(float(curve.knots[-1]))
    arcs = list(zip(ends[::2], ends[1::2], strict=True))
    if curve.closed and first and last:
        # the arc goes on behind the curve's own start
        (_, before), (after, _) = arcs[0], arcs[-1]
        arcs = [*arcs[1:-1], (after, before + 2 * np.pi)]
    return arcs


def _crossings(
    curve: TracedCurve, pieces: _Pieces, k: NDArray[np.intp], share: Array, inside: Mask, q_min: Array, q_max: Array
) -> Array:
    """Shares (n,) of pieces k (n,) at which they cross limits, between those given (2, n); `inside` (n,): at the first
    of these they are in. `curve` is any one of the pose."""
    # what is aimed at is inside, by half of what rounding is given

    def nearly(share: Array) -> Array:
        return _excess(pieces.at(k, share), q_min, q_max) + ROUNDING / 2

    def beyond(share: Array) -> Array:
        return _excess(curve.onto(pieces.at(k, share)), q_min, q_max) + ROUNDING / 2

    # the cubics cross limits next to where the curve does, at nearly the same rate
    at = _zeros(nearly, share, inside)
    slope = (nearly(at + STEP) - nearly(at - STEP)) / (2 * STEP)
    for _ in range(FROM_CUBICS):
        f = beyond(at)
        exact = np.abs(f) < ROUNDING / 2
        if exact.all():
            return at
        at = np.where(exact, at, np.clip(at - f / np.where(slope == 0, 1.0, slope), *share))
    return np.where(exact, at, _zeros(beyond, share, inside))


def _zeros(beyond: Callable[[Array], Array], share: Array, inside: Mask) -> Array:
    """Where a function of shares (n,) is zero, to ROUNDING, between those given (2, n); inside, if that is not found.
    `inside` (n,): whether it is negative at the first of them."""
    low, high = share
    f_low, f_high = beyond(low), beyond(high)
    found = np.full(len(low), np.nan)
    for _ in range(CROSSINGS):
        # regula falsi after Illinois: the end that stays counts half
        span = np.where(f_high == f_low, 1.0, f_high - f_low)
        at = np.clip(low - f_low * (high - low) / span, low, high)
        f = beyond(at)
        found = np.where(np.isnan(found) & (np.abs(f) < ROUNDING / 2), at, found)
        if not np.isnan(found).any():
            break
        is_low = (f <= 0) == inside
        f_high = np.where(is_low, f_high / 2, f)
        f_low = np.where(is_low, f, f_low / 2)
        low, high = np.where(is_low, at, low), np.where(is_low, high, at)
    return np.asarray(np.where(np.isnan(found), np.where(inside, low, high), found))


def _excess(q: Array, q_min: Array, q_max: Array) -> Array:
    """How far (n,) [rad] configurations (n, nq) are beyond limits, negative inside."""
    away = np.abs(wrapped(q - (q_min + q_max) / 2)) - (q_max - q_min) / 2
    # a joint that may turn all around has no limits
    return np.asarray(np.where(q_max - q_min >= 2 * np.pi, -np.pi, away).max(axis=1))
