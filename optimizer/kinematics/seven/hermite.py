"""Cubic Hermite interpolation."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def hermite(share: Array, q0: Array, q1: Array, slope0: Array, slope1: Array) -> Array:
    """Values (n, m) of cubics at shares (n,) from 0 to 1 of the way from q0 to q1 (n, m).

    `slope0` and `slope1` (n, m) are the derivatives by the share at both ends.
    """
    a, b, c, d = hermite_weights(share)[:, :, None]
    return np.asarray(a * q0 + b * q1 + c * slope0 + d * slope1)


def hermite_weights(share: Array) -> Array:
    """Weights (4, n) of q0, q1, slope0 and slope1 in `hermite` at shares (n,)."""
    rest = 1 - share
    a, b = (1 + 2 * share) * rest * rest, share * rest * rest
    return np.array([a, 1 - a, b, -share * share * rest])
