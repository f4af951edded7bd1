"""Boxes of postures: the joint ranges of an arm, or the neighbourhood of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.problem.arm import Arm

SPEED_TOLERANCE = 1e-5
"""Excess over a speed limit that a certificate admits, relative to the limit, and rounding."""


@dataclass(frozen=True)
class PostureSet:
    """Boxes with middles `centre` and half sides `half`, both of shape (n, nq) [rad]."""

    centre: Array
    half: Array

    @classmethod
    def of_ranges(cls, arm: Arm) -> PostureSet:
        """All postures of an arm; a whole turn is enough of a longer range."""
        limits = arm.active_limits
        half = np.minimum((limits.q_max - limits.q_min) / 2, np.pi)
        return cls((limits.q_min + limits.q_max)[None] / 2, half[None])

    @classmethod
    def along(cls, spline: Spline, arm: Arm, parts: int = 200) -> PostureSet:
        """Boxes around a motion within the speed limits, one per interval of equal duration.

        Within an interval of duration h, a joint stays within v_max · h / 2 of the mean of its
        positions at both ends.

        Args:
            spline: the motion.
            arm: the arm, for its speed limits.
            parts: number of intervals.
        """
        t = np.linspace(0.0, spline.duration, parts + 1)
        q = sample(spline, t)[0]
        half = arm.active_limits.v_max * (1 + SPEED_TOLERANCE) * spline.duration / parts / 2
        return cls((q[:-1] + q[1:]) / 2, np.repeat(half[None], parts, axis=0))

    def draw(self, count: int) -> Array:
        """Random postures in the boxes, shape (count, nq) [rad], from a fixed seed."""
        random = np.random.default_rng(0)
        box = random.integers(len(self.centre), size=count)
        share = random.uniform(-1.0, 1.0, (count, self.centre.shape[1]))
        return np.asarray(self.centre[box] + share * self.half[box])
