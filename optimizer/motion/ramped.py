"""Time scaling from 0 to 1 with an even speed between two ramps of cubic speed."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def fraction(tau: Array, ramp: float) -> Array:
    """s (k,) at τ (k,) in [0, 1].

    Each ramp takes a share `ramp` of the time, at most a half. The peak of s' is 1 / (1 - ramp).
    """
    near = np.minimum(tau, 1 - tau)
    x = np.minimum(near / ramp, 1.0)
    way = (ramp * (x**3 - x**4 / 2) + np.maximum(near - ramp, 0.0)) / (1 - ramp)
    return np.where(tau < 0.5, way, 1 - way)
