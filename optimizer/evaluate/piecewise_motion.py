"""A given motion as piecewise polynomials in time, block after block, so that memory does not grow
with its length.

- `linear`: constant velocity of every joint within a segment; velocity steps where segments meet
- `trapezoid`: trapezoidal velocity from standstill to standstill in every segment, with the
  acceleration times of the
  baseline `trapezoid`; acceleration steps
- `quintic`: 10 τ³ - 15 τ⁴ + 6 τ⁵ from standstill to standstill in every segment
- `spline`: one curve of degree 5 through all configurations, with standstill (v = a = 0) at the
  start and at the end
- a spline: its own polynomials
- a recording: a cubic spline (not-a-knot) through q, and others through v and a if these were
  recorded; if not, they are the derivatives of the spline before. Nothing is smoothed: an error e
  in q, with rows h apart, becomes an error of up to 12 e / h² in the acceleration
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.evaluate.recording import (
    BLOCK,
    RecordedRows,
    Recording,
    Waypoints,
    check_joints,
)
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.motion.time_scalings import blend_time
from joulepath.optimizer.problem.arm import Arm

Indices = npt.NDArray[np.int64]

# rows on either side of a block that its spline also passes through: the influence of a row on a
# cubic spline falls by a factor of 3.7 from row to row, and 1e-27 of it is left after 48 rows
OVERLAP = 48
# fraction of a segment's duration below which a phase of its trapezoid is left out
SHORTEST_PHASE = 1e-12


@dataclass(frozen=True)
class PiecewiseMotion:
    """A block of m consecutive polynomial pieces, between `breakpoints` (m + 1,) [s] after the
    start of the motion.

    `segment` (m,) is the segment of the motion that each piece belongs to. `q`, `v`, `a`, `jerk`
    are coefficients (degree + 1, m, nq) as in scipy's PPoly: highest power first, of the time since
    the start of the piece. If a log has its own v, that is not the derivative of q.
    """

    breakpoints: Array
    segment: Indices
    q: Array
    v: Array
    a: Array
    jerk: Array

    @staticmethod
    def of(curve: PPoly, segment: Indices) -> PiecewiseMotion:
        """The motion of a curve and its derivatives."""
        return PiecewiseMotion(
            curve.x, segment, *(curve.derivative(k).c if k else curve.c for k in range(4))
        )

    def at(self, piece: Indices, x: Array) -> tuple[Array, Array, Array, Array]:
        """q, v, a, jerk (k, nq) at times x (k,) [s] after the start of pieces (k,)."""
        q, v, a, jerk = (
            _horner(c[:, piece], x[:, None]) for c in (self.q, self.v, self.a, self.jerk)
        )
        return q, v, a, jerk

    def at_times(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """q, v, a, jerk (k, nq) at times t (k,) [s]; at a breakpoint, those of the later piece."""
        piece = np.clip(
            np.searchsorted(self.breakpoints, t, side="right") - 1, 0, len(self.segment) - 1
        )
        return self.at(piece, t - self.breakpoints[piece])


Motion = Waypoints | Recording | Spline
"""A given motion."""


def piecewise_motion(arm: Arm, motion: Motion) -> Iterator[PiecewiseMotion]:
    """The blocks of a motion in order of time. Raises InvalidTable or InvalidProblem."""
    if isinstance(motion, Recording):
        yield from _log(arm, motion)
        return
    if isinstance(motion, Spline):
        check_joints(arm, motion.control_points)
        yield _spline(motion)
        return
    motion.check(arm)
    ends = np.concatenate([[0.0], np.cumsum(motion.times)])
    if motion.interpolation == "spline":
        yield _smooth(motion, ends)
        return
    for low in range(0, motion.segments, BLOCK):
        rows = slice(low, min(low + BLOCK, motion.segments))
        yield _segments(motion, arm.active_limits, rows, ends[low])


def _spline(motion: Spline) -> PiecewiseMotion:
    """The polynomials of a spline: one segment with a piece for each knot span."""
    edges = np.unique(motion.knots)
    powers = [
        motion.curve(edges[:-1], order) / math.factorial(order)
        for order in range(motion.degree, -1, -1)
    ]
    return PiecewiseMotion.of(
        PPoly(np.stack(powers), edges), np.zeros(len(edges) - 1, dtype=np.int64)
    )


def _smooth(motion: Waypoints, ends: Array) -> PiecewiseMotion:
    """The curve of degree 5 through all waypoints, at the times `ends` (n,) [s]."""
    standstill = [(order, np.zeros(motion.q.shape[1])) for order in (1, 2)]
    # its knots are these times; scipy's type stubs know no list of derivatives
    curve = make_interp_spline(ends, motion.q, k=5, bc_type=(standstill, standstill))  # type: ignore[arg-type]
    powers = [curve(ends[:-1], order) / math.factorial(order) for order in range(5, -1, -1)]
    return PiecewiseMotion.of(PPoly(np.stack(powers), ends), np.arange(motion.segments))


def _segments(motion: Waypoints, limits: Limits, rows: slice, start: float) -> PiecewiseMotion:
    """Segments on straight lines in joint space, q_start + s(t) · displacement, the first at
    `start` [s].
    """
    q, T = motion.q[rows], motion.times[rows]
    displacement = motion.q[rows.start + 1 : rows.stop + 1] - q
    segment = np.arange(rows.start, rows.stop)
    if motion.interpolation == "linear":
        law, lengths = [1 / T, 0 * T], T
    elif motion.interpolation == "quintic":
        law, lengths = quintic.coefficients(T), T
    else:
        law, lengths = _trapezoid(T, blend_time(limits, displacement, T))
        kept = lengths > SHORTEST_PHASE * np.repeat(T, 3)
        law, lengths = [part[kept] for part in law], lengths[kept]
        q, displacement, segment = (
            np.repeat(each, 3, axis=0)[kept] for each in (q, displacement, segment)
        )
    coefficients = np.stack(law)[:, :, None] * displacement
    coefficients[-1] += q
    return PiecewiseMotion.of(
        PPoly(coefficients, start + np.concatenate([[0.0], np.cumsum(lengths)])), segment
    )


def _trapezoid(T: Array, blend: Array) -> tuple[list[Array], Array]:
    """Coefficients of s(t) in the three phases of n trapezoids of velocity, and the durations (3
    n,) [s] of the phases.

    T (n,) [s] is the duration, `blend` (n,) [s] the time of acceleration, and of deceleration.
    """
    speed = 1 / (T - blend)
    bend = speed / (2 * blend)
    none = 0 * T
    law = [
        np.stack([bend, none, -bend], axis=1).ravel(),
        np.stack([none, speed, speed], axis=1).ravel(),
        np.stack([none, speed * blend / 2, 1 - speed * blend / 2], axis=1).ravel(),
    ]
    return law, np.stack([blend, np.maximum(T - 2 * blend, 0.0), blend], axis=1).ravel()


def _log(arm: Arm, log: Recording) -> Iterator[PiecewiseMotion]:
    """A log in blocks. The spline of each also passes through OVERLAP rows on either side."""
    rows: RecordedRows | None = None
    begin = 0
    for block in log.checked(arm):
        rows = block if rows is None else _joined(rows, block)
        if len(rows.t) - begin > BLOCK + OVERLAP:
            end = len(rows.t) - 1 - OVERLAP
            yield _between(log, rows, begin, end)
            keep = max(end - OVERLAP, 0)
            rows, begin = _from(rows, keep), end - keep
    assert rows is not None  # logs of fewer than two rows are refused
    yield _between(log, rows, begin, len(rows.t) - 1)


def _between(log: Recording, rows: RecordedRows, begin: int, end: int) -> PiecewiseMotion:
    """The pieces from row `begin` to row `end` of the splines through all `rows` of a log."""
    q = CubicSpline(rows.t, rows.q)
    v = q.derivative() if rows.v is None else CubicSpline(rows.t, rows.v)
    a = v.derivative() if rows.a is None else CubicSpline(rows.t, rows.a)
    inside = (slice(None), slice(begin, end))
    curves = (curve.c[inside] for curve in (q, v, a, a.derivative()))
    # by their middles: an edge is the time of a row but for rounding
    segment = np.searchsorted(
        log.edges, (rows.t[begin:end] + rows.t[begin + 1 : end + 1]) / 2, side="right"
    )
    return PiecewiseMotion(rows.t[begin : end + 1], segment, *curves)


def _joined(first: RecordedRows, second: RecordedRows) -> RecordedRows:
    def join(one: Array | None, other: Array | None) -> Array | None:
        return None if one is None or other is None else np.concatenate([one, other])

    return RecordedRows(
        np.concatenate([first.t, second.t]),
        np.concatenate([first.q, second.q]),
        join(first.v, second.v),
        join(first.a, second.a),
    )


def _from(block: RecordedRows, row: int) -> RecordedRows:
    """The rows of a block from `row` on."""
    v, a = (None if part is None else part[row:] for part in (block.v, block.a))
    return RecordedRows(block.t[row:], block.q[row:], v, a)


def _horner(coefficients: Array, x: Array) -> Array:
    """Values (k, nq) at x (k, 1) of polynomials with coefficients (degree + 1, k, nq), highest
    power first.
    """
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * x + c
    return np.broadcast_to(value, (len(x), coefficients.shape[-1]))
