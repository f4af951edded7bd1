"""Concatenation of motions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
