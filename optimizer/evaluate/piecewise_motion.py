"""A given motion as piecewise polynomials in time, in blocks of limited memory.

- `linear`: constant velocity of every joint within a segment, with velocity steps between segments
- `trapezoid`: trapezoidal velocity from standstill to standstill in every segment, with the
  acceleration times of the baseline `trapezoid`, and acceleration steps
- `quintic`: 10 τ³ - 15 τ⁴ + 6 τ⁵ from standstill to standstill in every segment
- `spline`: one curve of degree 5 through all configurations, at rest (v = a = 0) at both ends
- a spline: its own polynomials
- a recording: a cubic spline (not-a-knot) through q, and others through v and a if these were
  recorded; otherwise the derivatives of the previous spline. Nothing is smoothed: an error e in q,
  with rows h apart, becomes an error of up to 12 e / h² in the acceleration
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
    MOTION_LIMITS,
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


@dataclass(frozen=True)
class PieceSettings:
    """Settings of the polynomial pieces."""

    overlap_rows: int = 48
    """Rows on either side of a block on its spline. The influence of a row on a cubic spline falls
    by a factor of 3.7 from row to row; 1e-27 of it is left after 48 rows."""
    min_phase: float = 1e-12
    """Duration of a phase of a trapezoid over that of the segment, up to which the phase is left
    out [1]."""


PIECES = PieceSettings()


@dataclass(frozen=True)
class PiecewiseMotion:
    """A block of m consecutive polynomial pieces.

    Coefficients (degree + 1, m, nq) are as in scipy's PPoly: highest power first, of the time since
    the start of the piece. A recorded v is not the derivative of q.
    """

    breakpoints: Array
    """Ends of the pieces (m + 1,), after the start of the motion [s]."""
    segment: Indices
    q: Array
    v: Array
    a: Array
    jerk: Array
    """Coefficients of the jerk."""

    @staticmethod
    def of(curve: PPoly, segment: Indices) -> PiecewiseMotion:
        """Pieces of a curve and its derivatives; `segment` (m,) is the segment of each piece."""
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
    """The blocks of a motion in order of time.

    Raises:
        InvalidTable: a row of the motion is wrong.
        InvalidProblem: the motion does not fit the arm.
    """
    if isinstance(motion, Recording):
        yield from _pieces_of_log(arm, motion)
        return
    if isinstance(motion, Spline):
        check_joints(arm, motion.control_points)
        yield _pieces_of_spline(motion)
        return
    motion.check(arm)
    ends = np.concatenate([[0.0], np.cumsum(motion.times)])
    if motion.interpolation == "spline":
        yield _pieces_of_curve(motion, ends)
        return
    for low in range(0, motion.segments, MOTION_LIMITS.block_rows):
        rows = slice(low, min(low + MOTION_LIMITS.block_rows, motion.segments))
        yield _pieces_of_segments(motion, arm.active_limits, rows, ends[low])


def _pieces_of_spline(motion: Spline) -> PiecewiseMotion:
    """Polynomials of a spline: one segment with a piece for each knot span."""
    edges = np.unique(motion.knots)
    powers = [
        motion.curve(edges[:-1], order) / math.factorial(order)
        for order in range(motion.degree, -1, -1)
    ]
    return PiecewiseMotion.of(
        PPoly(np.stack(powers), edges), np.zeros(len(edges) - 1, dtype=np.int64)
    )


def _pieces_of_curve(motion: Waypoints, ends: Array) -> PiecewiseMotion:
    """The curve of degree 5 through all waypoints, at the times `ends` (n,) [s]."""
    standstill = [(order, np.zeros(motion.q.shape[1])) for order in (1, 2)]
    # its knots are these times; scipy's type stubs know no list of derivatives
    at_ends = (standstill, standstill)
    curve = make_interp_spline(ends, motion.q, k=5, bc_type=at_ends)  # type: ignore[arg-type]
    powers = [curve(ends[:-1], order) / math.factorial(order) for order in range(5, -1, -1)]
    return PiecewiseMotion.of(PPoly(np.stack(powers), ends), np.arange(motion.segments))


def _pieces_of_segments(
    motion: Waypoints, limits: Limits, rows: slice, start: float
) -> PiecewiseMotion:
    """Segments on straight lines in joint space, q_start + s(t) · displacement, from `start` [s]
    on."""
    q, T = motion.q[rows], motion.times[rows]
    displacement = motion.q[rows.start + 1 : rows.stop + 1] - q
    segment = np.arange(rows.start, rows.stop)
    if motion.interpolation == "linear":
        law, lengths = [1 / T, 0 * T], T
    elif motion.interpolation == "quintic":
        law, lengths = quintic.coefficients(T), T
    else:
        law, lengths = _trapezoid(T, blend_time(limits, displacement, T))
        kept = lengths > PIECES.min_phase * np.repeat(T, 3)
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
    """Three phases of each of n trapezoids of velocity.

    Args:
        T: durations (n,) [s].
        blend: times of acceleration, and of deceleration (n,) [s].

    Returns:
        Coefficients of s(t) in the phases, and the durations (3 n,) of the phases [s].
    """
    speed = 1 / (T - blend)
    bend = speed / (2 * blend)
    zero = 0 * T
    law = [
        np.stack([bend, zero, -bend], axis=1).ravel(),
        np.stack([zero, speed, speed], axis=1).ravel(),
        np.stack([zero, speed * blend / 2, 1 - speed * blend / 2], axis=1).ravel(),
    ]
    return law, np.stack([blend, np.maximum(T - 2 * blend, 0.0), blend], axis=1).ravel()


def _pieces_of_log(arm: Arm, log: Recording) -> Iterator[PiecewiseMotion]:
    """Blocks of a log; the spline of each also passes through rows on either side."""
    rows: RecordedRows | None = None
    begin = 0
    for block in log.checked(arm):
        rows = block if rows is None else _concatenated(rows, block)
        if len(rows.t) - begin > MOTION_LIMITS.block_rows + PIECES.overlap_rows:
            end = len(rows.t) - 1 - PIECES.overlap_rows
            yield _between(log, rows, begin, end)
            keep = max(end - PIECES.overlap_rows, 0)
            rows, begin = _from(rows, keep), end - keep
    assert rows is not None  # logs of fewer than two rows are refused
    yield _between(log, rows, begin, len(rows.t) - 1)


def _between(log: Recording, rows: RecordedRows, begin: int, end: int) -> PiecewiseMotion:
    """Pieces from row `begin` to row `end` of the splines through all rows."""
    q = CubicSpline(rows.t, rows.q)
    v = q.derivative() if rows.v is None else CubicSpline(rows.t, rows.v)
    a = v.derivative() if rows.a is None else CubicSpline(rows.t, rows.a)
    inside = (slice(None), slice(begin, end))
    curves = (curve.c[inside] for curve in (q, v, a, a.derivative()))
    # by the middles of the pieces, because an edge is the time of a row up to rounding errors
    segment = np.searchsorted(
        log.edges, (rows.t[begin:end] + rows.t[begin + 1 : end + 1]) / 2, side="right"
    )
    return PiecewiseMotion(rows.t[begin : end + 1], segment, *curves)


def _concatenated(first: RecordedRows, second: RecordedRows) -> RecordedRows:
    def join(one: Array | None, other: Array | None) -> Array | None:
        return None if one is None or other is None else np.concatenate([one, other])

    return RecordedRows(
        np.concatenate([first.t, second.t]),
        np.concatenate([first.q, second.q]),
        join(first.v, second.v),
        join(first.a, second.a),
    )


def _from(block: RecordedRows, row: int) -> RecordedRows:
    """Rows of a block from `row` on."""
    v, a = (None if part is None else part[row:] for part in (block.v, block.a))
    return RecordedRows(block.t[row:], block.q[row:], v, a)


def _horner(coefficients: Array, x: Array) -> Array:
    """Values (k, nq) of polynomials by Horner's method.

    Args:
        coefficients: coefficients (degree + 1, k, nq), highest power first.
        x: arguments (k, 1).
    """
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * x + c
    return np.broadcast_to(value, (len(x), coefficients.shape[-1]))
