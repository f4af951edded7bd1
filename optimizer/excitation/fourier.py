"""Fourier series of joint positions at rest at both ends of their period (Swevers et al. 1997).

q_j(t) = centre_j + Σ_k a_jk sin(kωt) / (kω) − b_jk cos(kωt) / (kω),  ω = 2π / period

Standstill (v = a = 0) at the ends of the period means Σ_k a_jk = 0 and Σ_k k b_jk = 0, which
removes two dimensions per joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE, clamped, fit
from joulepath.optimizer.motion.spline import Spline


@dataclass(frozen=True)
class SeriesSplineSettings:
    """Settings of the spline of a series."""

    spans: int = 24
    """Knot spans per harmonic; the spline differs from the series by some 1e-9 rad."""


SERIES_SPLINE = SeriesSplineSettings()


@dataclass(frozen=True)
class FourierBasis:
    """Series with some harmonics over a period [s].

    The coordinates (1 + free, joints) of a motion are its centre, and then coordinates in the space
    of series at rest at both ends.
    """

    period: float
    harmonics: int

    @cached_property
    def resting(self) -> Array:
        """Orthonormal basis (2 harmonics, free) of the coefficients a, then b, of series at rest at
        the ends."""
        k = np.arange(1, self.harmonics + 1)
        zero = np.zeros(self.harmonics)
        return np.asarray(null_space(np.array([[*np.ones(self.harmonics), *zero], [*zero, *k]])))

    @property
    def free(self) -> int:
        """Number of coordinates of a joint beside its centre."""
        return 2 * self.harmonics - 2

    def matrix(self, t: Array, derivative: int) -> Array:
        """Derivatives of the positions by the coordinates.

        Args:
            t: times (m,) [s].
            derivative: order of the time derivative.

        Returns:
            Matrix (m, 1 + free).
        """
        w = 2 * np.pi / self.period * np.arange(1, self.harmonics + 1)
        # the d-th derivative of a sine shifts the phase by d quarters of a turn, and multiplies by
        # the frequency
        phase = np.outer(t, w) + derivative * np.pi / 2
        series = np.hstack([np.sin(phase), -np.cos(phase)]) * np.tile(w ** (derivative - 1), 2)
        centre = np.full((len(t), 1), 1.0 if derivative == 0 else 0.0)
        return np.hstack([centre, series @ self.resting])

    def coefficients(self, coordinates: Array) -> tuple[Array, Array, Array]:
        """Centre (joints,) [rad], a and b (joints, harmonics) [rad/s] for coordinates (1 + free,
        joints)."""
        both = (self.resting @ coordinates[1:]).T
        return coordinates[0], both[:, : self.harmonics], both[:, self.harmonics :]

    def spline(self, coordinates: Array) -> Spline:
        """The motion as a spline that is exactly at rest at its ends."""
        spans = SERIES_SPLINE.spans * self.harmonics
        knots = clamped(np.linspace(0.0, 1.0, spans + 1))
        at = np.linspace(0.0, 1.0, 4 * spans + 1)
        samples = self.matrix(at * self.period, 0) @ coordinates
        # the curve begins and ends in the same point up to rounding errors
        samples[-1] = samples[0]
        return Spline(DEGREE, knots * self.period, fit(samples, at, knots))
