"""Points at equal times, for controllers that take points and times and interpolate in a way of
their own.

What such a controller does between the points is not published. Two courses are taken for it that
lie to either side, and the larger deviation from the spline is stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.export.program import Move

SHORTEST = 0.02
"""Least time [s] between two points: controllers plan a few dozen points a second."""
MOST_POINTS = 500
"""Most points of a move: a spline block of KRL holds no more."""
# instants per segment at which the deviation is measured
FINE = 16

Course = Callable[[Array, Array], Callable[[Array], Array]]
"""From times (k,) [s] and points (k, nq) to the position (m, nq) at times (m,)."""


@dataclass(frozen=True)
class EvenPoints:
    """Points q (k, nq) [rad] of a move, `period` [s] apart, the first at its start; largest
    deviation [rad].
    """

    q: Array
    period: float
    deviation: float


def even_points(move: Move, courses: tuple[Course, ...], tolerance: float) -> EvenPoints:
    """The fewest points with which all courses stay within the tolerance [rad]; if none do, as many
    as may be.
    """
    most = max(min(math.floor(move.duration / SHORTEST), MOST_POINTS), 2)
    count = min(4, most)
    while True:
        t = np.linspace(0.0, move.duration, count + 1)
        q = np.asarray(move.spline.curve(t))
        fine = np.linspace(0.0, move.duration, count * FINE + 1)
        truth = move.spline.curve(fine)
        deviation = max(float(np.abs(course(t, q)(fine) - truth).max()) for course in courses)
        if deviation <= tolerance or count == most:
            return EvenPoints(q, move.duration / count, deviation)
        count = min(math.ceil(count * 1.5), most)


def straight(t: Array, q: Array) -> BSpline:
    """Straight lines from point to point, each in its time: no rounding of corners."""
    return BSpline(np.concatenate([t[:1], t, t[-1:]]), q, 1)


def rounded(t: Array, q: Array) -> Callable[[Array], Array]:
    """Corners rounded as far as they may be: the speed changes evenly from the middle of one line
    to that of the next."""
    speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
    times = np.concatenate([t[:1], (t[:-1] + t[1:]) / 2, t[-1:]])
    speed = straight(times, np.concatenate([speeds[:1], speeds, speeds[-1:]]))
    travelled = speed.antiderivative()
    return lambda at: q[0] + travelled(at)


def smooth(t: Array, q: Array) -> CubicSpline:
    """A cubic spline through the points, with standstill at both ends."""
    return CubicSpline(t, q, bc_type="clamped")
