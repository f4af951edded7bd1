"""Fourier series of joint positions that are at rest at both ends of their period (Swevers et al.
1997).

q_j(t) = centre_j + Σ_k a_jk sin(kωt) / (kω) − b_jk cos(kωt) / (kω),  ω = 2π / period

v = a = 0 at the ends of the period is Σ_k a_jk = 0 and Σ_k k b_jk = 0: two directions fewer for
each joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE, clamped, fit
from joulepath.optimizer.motion.spline import Spline

# knot spans of the spline for every harmonic: it differs from the series by some 1e-9 rad
_SPANS = 24


@dataclass(frozen=True)
class FourierBasis:
    """Series of some `harmonics` over a `period` [s].

    Coordinates of a motion are (1 + free, joints): the centre, then the coordinates in the space of
    series at rest.
    """

    period: float
    harmonics: int

    @cached_property
    def resting(self) -> Array:
        """Orthonormal directions (2 harmonics, free) of the coefficients a, then b, of series that
        rest at the ends.
        """
        k = np.arange(1, self.harmonics + 1)
        zero = np.zeros(self.harmonics)
        return np.asarray(null_space(np.array([[*np.ones(self.harmonics), *zero], [*zero, *k]])))

    @property
    def free(self) -> int:
        """Number of coordinates of each joint beside its centre."""
        return 2 * self.harmonics - 2

    def matrix(self, t: Array, derivative: int) -> Array:
        """The derivative (m, 1 + free) of q at times t (m,) [s] by the coordinates."""
        w = 2 * np.pi / self.period * np.arange(1, self.harmonics + 1)
        # of sin: the derivative d shifts the phase by d quarters of a turn, and multiplies by the
        # frequency
        phase = np.outer(t, w) + derivative * np.pi / 2
        series = np.hstack([np.sin(phase), -np.cos(phase)]) * np.tile(w ** (derivative - 1), 2)
        centre = np.full((len(t), 1), 1.0 if derivative == 0 else 0.0)
        return np.hstack([centre, series @ self.resting])

    def coefficients(self, coordinates: Array) -> tuple[Array, Array, Array]:
        """Centre (joints,) [rad], a and b (joints, harmonics) [rad/s] of coordinates (1 + free,
        joints).
        """
        both = (self.resting @ coordinates[1:]).T
        return coordinates[0], both[:, : self.harmonics], both[:, self.harmonics :]

    def spline(self, coordinates: Array) -> Spline:
        """The motion as a spline that is exactly at rest at its ends."""
        spans = _SPANS * self.harmonics
        knots = clamped(np.linspace(0.0, 1.0, spans + 1))
        at = np.linspace(0.0, 1.0, 4 * spans + 1)
        samples = self.matrix(at * self.period, 0) @ coordinates
        # the curve begins and ends in the same point, but for rounding
        samples[-1] = samples[0]
        return Spline(DEGREE, knots * self.period, fit(samples, at, knots))
