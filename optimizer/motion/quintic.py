"""The rest-to-rest quintic s(τ) = 10 τ³ - 15 τ⁴ + 6 τ⁵ from 0 to 1, with s' = s'' = 0 at both
ends.
"""

from __future__ import annotations

import math

import numpy as np

from joulepath.models.robot import Array

PEAKS = np.array([15 / 8, 10 / math.sqrt(3), 60.0])
"""Greatest |s'|, |s''| and |s'''| on [0, 1]."""


def fraction(tau: Array) -> Array:
    """s (k,) at τ (k,)."""
    return np.asarray(tau**3 * (10 - 15 * tau + 6 * tau**2))


def derivatives(tau: Array) -> Array:
    """s, s' and s'' (3, k) at τ (k,)."""
    return np.stack(
        [fraction(tau), 30 * (tau * (1 - tau)) ** 2, 60 * tau * (1 - tau) * (1 - 2 * tau)]
    )


def coefficients(duration: Array) -> list[Array]:
    """Coefficients of s(t / T) as a polynomial in t [s], highest power first, one array of the
    shape of T [s] per coefficient.
    """
    none = 0 * duration
    return [6 / duration**5, -15 / duration**4, 10 / duration**3, none, none, none]
