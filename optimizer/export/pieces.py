"""Polynomial pieces of a spline, one per knot span."""

from __future__ import annotations

import math

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.spline import Spline


def breaks(spline: Spline) -> Array:
    """Ends (m + 1,) of the knot spans with a positive length [s]."""
    return np.unique(spline.knots)


def pieces(spline: Spline) -> tuple[Array, Array]:
    """Polynomial pieces of a spline, as functions of the elapsed share of their time in [0, 1].

    Returns:
        Ends of the pieces (m + 1,) [s], and coefficients (m, degree + 1, nq) [rad], the constant
        ones first.
    """
    edges, curve = breaks(spline), spline.curve
    length = np.diff(edges)[:, None]
    powers = [
        curve(edges[:-1], k) * length**k / math.factorial(k) for k in range(spline.degree + 1)
    ]
    return edges, np.stack(powers, axis=1)
