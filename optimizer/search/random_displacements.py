"""Random displacements of a motion, from which other local optima are found: half waves that vanish
at both ends.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from joulepath.models.robot import Array, Limits

# half waves, least and largest standard deviation of their amplitudes [rad]: the motions of least
# work swing far
WAVES, AMPLITUDES = 3, (1.0, 5.0)
# share of each limit on speed, acceleration and jerk that a displacement may use: far beyond the
# limits, solves would spend their time on getting back
SHARE = 1.0
SEED = 0


def random_displacements(limits: Limits, duration: float, at: Array, count: int) -> Iterator[Array]:
    """`count` displacements (k, nq) [rad] of a motion of `duration` [s] at fractions `at` (k,) of
    it.
    """
    half_waves = np.arange(1, WAVES + 1)
    waves = np.sin(np.pi * np.outer(at, half_waves))
    # greatest rate of a wave of amplitude 1 (derivative, wave) per limit
    steepest = (np.pi * half_waves / duration) ** np.arange(1, 4)[:, None]
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        size = np.exp(rng.uniform(*np.log(AMPLITUDES)))
        amplitude = rng.normal(size=(WAVES, limits.q_min.size)) * (size / half_waves[:, None])
        amplitude *= np.minimum(
            1.0, (SHARE * limits.rates / (steepest @ np.abs(amplitude))).min(axis=0)
        )
        yield waves @ amplitude
