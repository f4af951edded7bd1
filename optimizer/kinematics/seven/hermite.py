"""Cubic Hermite interpolation."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def hermite(share: Array, q0: Array, q1: Array, slope0: Array, slope1: Array) -> Array:
    """Values (n, m) of cubics at shares (n,) from 0 to 1 of the way from q0 to q1 (n, m).

    `slope0` and `slope1` (n, m) are the derivatives by the share at both ends.
    """
    rest = (1 - share)[:, None]
    share = share[:, None]
    start = (1 + 2 * share) * rest * rest
    slopes = share * rest * rest * slope0 - share * share * rest * slope1
    return np.asarray(start * q0 + (1 - start) * q1 + slopes)
