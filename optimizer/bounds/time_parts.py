"""The steps of a path, split into parts that are short where the greatest speed rises or falls
fast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.reference import greatest_speed
from joulepath.optimizer.collision.bodies import Indices

# a part is no longer than this [s] while speed is short of time to build up, nor are there more of
# them in a step
_SHORT, _MOST = 0.015, 24


@dataclass(frozen=True)
class TimeParts:
    """Parts of steps: `step` (P,) the step of each, both ends (P, 2) as shares of it, and `length`
    (P,), which adds up to 1; `speed` (B, P, nq) [rad/s] bounds the speeds in it, for B greatest
    durations."""

    step: Indices
    within: Array
    length: Array
    speed: Array

    @classmethod
    def of(cls, steps: int, limits: Limits, duration: Array) -> TimeParts:
        """The parts of so many steps of motions of at most `duration` (B,) [s]."""
        longest = float(duration.max())
        build_up = float((limits.v_max / limits.a_max + limits.a_max / limits.j_max).max())
        k = np.arange(steps)
        left = np.minimum(k, steps - 1 - k) * longest / steps
        count = np.where(
            left < build_up, np.clip(np.ceil(longest / steps / _SHORT), 1, _MOST), 1
        ).astype(int)
        step = np.repeat(k, count)
        part = np.arange(len(step)) - np.repeat(np.cumsum(count) - count, count)
        within = np.stack([part, part + 1], axis=1) / count[step][:, None]
        share = (step[:, None] + within) / steps
        # the part's instant that is farthest from both ends
        inner = np.where(
            (share[:, 0] < 0.5) & (share[:, 1] > 0.5), 0.5, np.minimum(share[:, 1], 1 - share[:, 0])
        )
        return cls(
            step,
            within,
            1 / (steps * count[step]),
            greatest_speed(limits, duration[:, None] * inner),
        )

    def mean_speed(self, which: Indices) -> Array:
        """The means (k, S, nq) [rad/s] of the speeds in each step, for some of the greatest
        durations.
        """
        first = np.flatnonzero(np.diff(self.step, prepend=-1))
        weight = self.length[:, None] * len(first)
        return np.asarray(np.add.reduceat(self.speed[which] * weight, first, axis=1))
