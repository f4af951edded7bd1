"""A B-spline of degree 5 through samples of position, velocity and acceleration."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.motion.spline import Spline


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
