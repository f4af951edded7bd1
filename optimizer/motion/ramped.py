"""Time scaling from 0 to 1 with an even speed between two ramps of cubic speed."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array


def fraction(tau: Array, ramp: float) -> Array:
    """s (k,) at τ (k,) in [0, 1].

    Each ramp takes a share `ramp` of the time, at most a half. The peak of s' is 1 / (1 - ramp).
    """
    to_end = np.minimum(tau, 1 - tau)
    x = np.minimum(to_end / ramp, 1.0)
    travel = (ramp * (x**3 - x**4 / 2) + np.maximum(to_end - ramp, 0.0)) / (1 - ramp)
    return np.where(tau < 0.5, travel, 1 - travel)
