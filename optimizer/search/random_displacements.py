"""Random displacements of a motion as starts for other local optima: half waves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits


@dataclass(frozen=True)
class DisplacementSettings:
    """Settings of random displacements."""

    waves: int = 3
    """Number of half waves."""
    least_amplitude: float = 1.0
    """Least standard deviation of amplitudes [rad]."""
    most_amplitude: float = 5.0
    """Greatest standard deviation of amplitudes [rad]: motions of least work swing far."""
    limit_share: float = 1.0
    """Share of each limit on speed, acceleration and jerk that a displacement may use.

    From far beyond the limits, solves would spend their time on the way back.
    """
    seed: int = 0
    """Seed of the random numbers."""


DISPLACEMENTS = DisplacementSettings()


def random_displacements(limits: Limits, duration: float, at: Array, count: int) -> Iterator[Array]:
    """Random displacements of a motion, each of shape (k, nq) [rad].

    Args:
        limits: limits of the joints.
        duration: duration of the motion [s].
        at: fractions of the duration, shape (k,).
        count: number of displacements.
    """
    settings = DISPLACEMENTS
    amplitudes = settings.least_amplitude, settings.most_amplitude
    half_waves = np.arange(1, settings.waves + 1)
    waves = np.sin(np.pi * np.outer(at, half_waves))
    # greatest rate of a wave of amplitude 1 (derivative, wave) per limit
    steepest = (np.pi * half_waves / duration) ** np.arange(1, 4)[:, None]
    rng = np.random.default_rng(settings.seed)
    for _ in range(count):
        size = np.exp(rng.uniform(*np.log(amplitudes)))
        amplitude = rng.normal(size=(len(half_waves), limits.q_min.size))
        amplitude = amplitude * (size / half_waves[:, None])
        allowed = settings.limit_share * limits.rates
        amplitude *= np.minimum(1.0, (allowed / (steepest @ np.abs(amplitude))).min(axis=0))
        yield waves @ amplitude
