"""Points at equal times, for controllers with their own interpolation between points and times.

The interpolation of such a controller is not published. Two courses on either side of it are
assumed, and the larger deviation from the spline is stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.export.program import Move


@dataclass(frozen=True)
class EvenPointSettings:
    """Settings of the choice of points."""

    min_period: float = 0.02
    """Smallest time between two points [s]; controllers plan a few dozen points a second."""
    max_points: int = 500
    """Largest number of points of a move; a spline block of KRL holds no more."""
    first_count: int = 4
    """Number of segments that is tried first."""
    growth: float = 1.5
    """Factor between two numbers of segments that are tried."""
    checks_per_segment: int = 16
    """Instants per segment at which the deviation is measured."""


EVEN_POINTS = EvenPointSettings()
Course = Callable[[Array, Array], Callable[[Array], Array]]
"""From times (k,) [s] and points (k, nq) to the position (m, nq) at times (m,)."""


@dataclass(frozen=True)
class EvenPoints:
    """Points of a move at equal times, the first at its start."""

    q: Array
    """Positions (k, nq) [rad]."""
    period: float
    """Time between two points [s]."""
    deviation: float
    """Largest deviation from the spline [rad]."""


def even_points(move: Move, courses: tuple[Course, ...], tolerance: float) -> EvenPoints:
    """The fewest points with which all courses stay within a tolerance.

    If no number of points is sufficient, the largest allowed number is taken.

    Args:
        move: the move.
        courses: assumed interpolations of the controller.
        tolerance: largest deviation from the spline [rad].
    """
    settings = EVEN_POINTS
    most = max(min(math.floor(move.duration / settings.min_period), settings.max_points), 2)
    count = min(settings.first_count, most)
    while True:
        t = np.linspace(0.0, move.duration, count + 1)
        q = np.asarray(move.spline.curve(t))
        checked = np.linspace(0.0, move.duration, count * settings.checks_per_segment + 1)
        exact = move.spline.curve(checked)
        deviation = max(float(np.abs(course(t, q)(checked) - exact).max()) for course in courses)
        if deviation <= tolerance or count == most:
            return EvenPoints(q, move.duration / count, deviation)
        count = min(math.ceil(count * settings.growth), most)


def straight(t: Array, q: Array) -> BSpline:
    """Straight lines from point to point, without rounding of corners."""
    return BSpline(np.concatenate([t[:1], t, t[-1:]]), q, 1)


def rounded(t: Array, q: Array) -> Callable[[Array], Array]:
    """Corners rounded as far as possible: the speed changes evenly between the middles of two
    lines."""
    speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
    times = np.concatenate([t[:1], (t[:-1] + t[1:]) / 2, t[-1:]])
    speed = straight(times, np.concatenate([speeds[:1], speeds, speeds[-1:]]))
    travelled = speed.antiderivative()
    return lambda at: q[0] + travelled(at)


def smooth(t: Array, q: Array) -> CubicSpline:
    """A cubic spline through the points, with standstill at both ends."""
    return CubicSpline(t, q, bc_type="clamped")
