"""A spline as polynomials, one per knot span."""

from __future__ import annotations

import math

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.spline import Spline


def breaks(spline: Spline) -> Array:
    """Ends (m + 1,) [s] of the knot spans that have a length."""
    return np.unique(spline.knots)


def pieces(spline: Spline) -> tuple[Array, Array]:
    """Ends (m + 1,) [s] of the pieces and their coefficients (m, degree + 1, nq) [rad], the
    constant ones first.

    A piece is a polynomial of the share of its time that has passed, in [0, 1].
    """
    edges, curve = breaks(spline), spline.curve
    length = np.diff(edges)[:, None]
    powers = [
        curve(edges[:-1], k) * length**k / math.factorial(k) for k in range(spline.degree + 1)
    ]
    return edges, np.stack(powers, axis=1)
