"""Steps of a path in parts, short while the limits on acceleration or jerk restrict the speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.reference import greatest_speed
from joulepath.optimizer.collision.bodies import Indices


@dataclass(frozen=True)
class PartSettings:
    """Settings of the division of steps into parts."""

    longest: float = 0.015
    """Longest part [s] while the limits on acceleration and jerk restrict the speed."""
    most_parts: int = 24
    """Largest number of parts of a step."""


PARTS = PartSettings()


@dataclass(frozen=True)
class TimeParts:
    """Parts of the steps of a path."""

    step: Indices
    """Step of each part, shape (P,)."""
    within: Array
    """First and last instant of each part as shares of its step, shape (P, 2)."""
    length: Array
    """Length of each part as a share of the motion, shape (P,); the sum is 1."""
    speed: Array
    """Bounds on the speed in each part for B durations, shape (B, P, nq) [rad/s]."""

    @classmethod
    def of(cls, steps: int, limits: Limits, duration: Array) -> TimeParts:
        """The parts of the steps of motions.

        Args:
            steps: number of steps.
            limits: limits on speed, acceleration and jerk.
            duration: greatest durations, shape (B,) [s].
        """
        longest = float(duration.max())
        build_up = float((limits.v_max / limits.a_max + limits.a_max / limits.j_max).max())
        k = np.arange(steps)
        left = np.minimum(k, steps - 1 - k) * longest / steps
        count = np.where(
            left < build_up,
            np.clip(np.ceil(longest / steps / PARTS.longest), 1, PARTS.most_parts),
            1,
        ).astype(int)
        step = np.repeat(k, count)
        part = np.arange(len(step)) - np.repeat(np.cumsum(count) - count, count)
        within = np.stack([part, part + 1], axis=1) / count[step][:, None]
        share = (step[:, None] + within) / steps
        # the instant of each part at the greatest distance from both ends of the motion
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
        """Mean bounds on the speed in each step, shape (k, S, nq) [rad/s].

        Args:
            which: indices of durations, shape (k,).
        """
        first = np.flatnonzero(np.diff(self.step, prepend=-1))
        weight = self.length[:, None] * len(first)
        return np.asarray(np.add.reduceat(self.speed[which] * weight, first, axis=1))
