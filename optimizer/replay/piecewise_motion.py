"""A given motion as polynomials in time, a few thousand pieces at a time, so that memory does not grow with its length.

- `linear`: constant speed of every joint within a segment; speed jumps where segments meet
- `trapezoid`: from rest to rest in every segment, speeding up and slowing down as the baseline `trapezoid` does;
  acceleration jumps
- `quintic`: from rest to rest in every segment, 10 τ³ - 15 τ⁴ + 6 τ⁵
- `spline`: one curve of degree 5 through all configurations, at rest (v = a = 0) at both ends
- a log: a cubic spline (not-a-knot) through q, and through v and a where these were logged; where they were not, they
  are the derivatives of the spline before. Nothing is smoothed: an error e in q, at rows h apart, comes out as an error
  of up to 12 e / h² in the acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from models.robot import Array, Limits
from optimizer.problem.arm import Arm
from optimizer.replay.recording import BLOCK, Log, LogBlock, Waypoints
from optimizer.trajectories import quintic
from optimizer.trajectories.time_scalings import blend_time

# A cubic spline forgets a row's value by a factor of 3.7 from row to row: 48 rows further on, 1e-27 of it is left, and
# a spline through a stretch of a log with so many rows on either side is the spline through all of it.
OVERLAP = 48


@dataclass(frozen=True)
class PiecewiseMotion:
    """Consecutive polynomial pieces: `breaks` (m + 1,) [s] from the motion's start, `segment` (m,) that each is in.

    `q`, `v`, `a`, `jerk` hold coefficients (degree + 1, m, nq), highest power first, of the time since the piece's
    start: scipy's PPoly. v need not be the derivative of q: where a log brings its own, it is the log's.
    """

    breaks: Array
    segment: npt.NDArray[np.int64]
    q: Array
    v: Array
    a: Array
    jerk: Array

    @staticmethod
    def of(curve: PPoly, segment: npt.NDArray[np.int64]) -> PiecewiseMotion:
        """PiecewiseMotion of a curve and its derivatives."""
        return PiecewiseMotion(curve.x, segment, *(curve.derivative(k).c if k else curve.c for k in range(4)))

    def at(self, piece: npt.NDArray[np.int64], x: Array) -> tuple[Array, Array, Array, Array]:
        """q, v, a, jerk (k, nq) at x (k,) [s] into the pieces (k,)."""
        q, v, a, jerk = (_horner(c[:, piece], x[:, None]) for c in (self.q, self.v, self.a, self.jerk))
        return q, v, a, jerk


def piecewise_motion(arm: Arm, motion: Waypoints | Log) -> Iterator[PiecewiseMotion]:
    """The motion's pieces in the order of time. Raises InvalidTable or InvalidProblem."""
    if isinstance(motion, Log):
        yield from _log(arm, motion)
        return
    motion.check(arm)
    ends = np.concatenate([[0.0], np.cumsum(motion.times)])
    if motion.interpolation == "spline":
        at_rest = [(order, np.zeros(motion.q.shape[1])) for order in (1, 2)]
        # its knots are the configurations' times; the stubs know no list of derivatives
        curve = make_interp_spline(ends, motion.q, k=5, bc_type=(at_rest, at_rest))  # type: ignore[arg-type]
        powers = [curve(ends[:-1], order) / math.factorial(order) for order in range(5, -1, -1)]
        yield PiecewiseMotion.of(PPoly(np.stack(powers), ends), np.arange(motion.segments))
        return
    for low in range(0, motion.segments, BLOCK):
        rows = slice(low, min(low + BLOCK, motion.segments))
        yield _segments(motion, arm.active_limits, rows, ends[low])


def _segments(motion: Waypoints, limits: Limits, rows: slice, start: float) -> PiecewiseMotion:
    """Segments that are straight lines in joint space: q_start + s(t) · displacement."""
    q, T = motion.q[rows], motion.times[rows]
    displacement = motion.q[rows.start + 1 : rows.stop + 1] - q
    segment = np.arange(rows.start, rows.stop)
    if motion.interpolation == "linear":
        law, lengths = [1 / T, 0 * T], T
    elif motion.interpolation == "quintic":
        law, lengths = quintic.coefficients(T), T
    else:
        blend = blend_time(limits, displacement, T)
        speed = 1 / (T - blend)
        bend = speed / (2 * blend)
        cruise = np.maximum(T - 2 * blend, 0.0)
        none = 0 * T
        law = [
            np.stack([bend, none, -bend], axis=1).ravel(),
            np.stack([none, speed, speed], axis=1).ravel(),
            np.stack([none, speed * blend / 2, 1 - speed * blend / 2], axis=1).ravel(),
        ]
        lengths = np.stack([blend, cruise, blend], axis=1).ravel()
        real = lengths > 1e-12 * np.repeat(T, 3)
        law, lengths = [part[real] for part in law], lengths[real]
        q, displacement, segment = (np.repeat(each, 3, axis=0)[real] for each in (q, displacement, segment))
    coefficients = np.stack(law)[:, :, None] * displacement
    coefficients[-1] += q
    return PiecewiseMotion.of(PPoly(coefficients, start + np.concatenate([[0.0], np.cumsum(lengths)])), segment)


def _log(arm: Arm, log: Log) -> Iterator[PiecewiseMotion]:
    """A log in stretches, each with rows on either side that its spline needs and its pieces leave out."""
    held: LogBlock | None = None
    begin = 0
    for block in log.checked(arm):
        held = block if held is None else _joined(held, block)
        if len(held.t) - begin > BLOCK + OVERLAP:
            end = len(held.t) - 1 - OVERLAP
            yield _stretch(held, begin, end)
            keep = max(end - OVERLAP, 0)
            held, begin = _from(held, keep), end - keep
    assert held is not None  # fewer than two rows are refused
    yield _stretch(held, begin, len(held.t) - 1)


def _stretch(block: LogBlock, begin: int, end: int) -> PiecewiseMotion:
    """The pieces from row `begin` to row `end` of the spline through all rows of the block."""
    q = CubicSpline(block.t, block.q)
    v = q.derivative() if block.v is None else CubicSpline(block.t, block.v)
    a = v.derivative() if block.a is None else CubicSpline(block.t, block.a)
    inside = (slice(None), slice(begin, end))
    curves = (curve.c[inside] for curve in (q, v, a, a.derivative()))
    return PiecewiseMotion(block.t[begin : end + 1], np.zeros(end - begin, dtype=np.int64), *curves)


def _joined(first: LogBlock, second: LogBlock) -> LogBlock:
    def join(one: Array | None, other: Array | None) -> Array | None:
        return None if one is None or other is None else np.concatenate([one, other])

    return LogBlock(
        np.concatenate([first.t, second.t]),
        np.concatenate([first.q, second.q]),
        join(first.v, second.v),
        join(first.a, second.a),
    )


def _from(block: LogBlock, row: int) -> LogBlock:
    return LogBlock(block.t[row:], *(None if part is None else part[row:] for part in (block.q, block.v, block.a)))  # type: ignore[arg-type]


def _horner(coefficients: Array, x: Array) -> Array:
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * x + c
    return np.broadcast_to(value, (len(x), coefficients.shape[-1]))
