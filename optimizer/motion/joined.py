"""Concatenation of motions, and splines through samples of a motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE, REST_POINTS
from joulepath.optimizer.motion.spline import Spline


def joined(motions: Sequence[Spline]) -> Spline:
    """One motion from several motions of degree DEGREE, at rest where one ends and the next begins.

    At rest, three control points coincide at the end of one motion, and at the start of the next.
    Three of these six are enough at a knot of multiplicity three with zero speed and acceleration.
    """
    knots, points, t = (
        [motions[0].knots[:-REST_POINTS]],
        [motions[0].control_points],
        motions[0].duration,
    )
    for motion in motions[1:]:
        knots.append(motion.knots[DEGREE + 1 : -REST_POINTS] + t)
        points.append(motion.control_points[REST_POINTS:])
        t += motion.duration
    return Spline(DEGREE, np.concatenate([*knots, np.full(REST_POINTS, t)]), np.concatenate(points))


def spline_through(t: Array, q: Array, v: Array, a: Array) -> Spline:
    """The motion of quintics between samples q, v, a (k, nq) at times t (k,) [s], with t[0] = 0.

    Every inner sample is a knot of multiplicity three. The three control points around it are
    values of the blossom of the quintics, with three of the five arguments at the sample:

        f(h₁, h₂) = q + (h₁ + h₂) v / 5 + h₁ h₂ a / 20

    for the distances h₁ and h₂ [s] of the other two arguments from the sample.
    """
    before, after = np.diff(t, prepend=t[0])[:, None], np.diff(t, append=t[-1])[:, None]
    pairs = ((-before, -before), (-before, after), (after, after))
    around = [q + (first + second) / 5 * v + first * second / 20 * a for first, second in pairs]
    points = np.stack(around, axis=1).reshape(-1, q.shape[1])
    ends = np.full(DEGREE - 2, t[0]), np.full(DEGREE - 2, t[-1])
    return Spline(DEGREE, np.concatenate([ends[0], np.repeat(t, 3), ends[1]]), points)
