"""What a dual bound is built around: a path, multipliers along it, and the region that motions of
the pair stay in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits

# what a half side of the region is at least [rad], so that no joint's is empty
_LEAST_HALF = 1e-6


@dataclass(frozen=True)
class Reference:
    """A path `x` (S + 1, nq) [rad] over equal steps of the share s of a motion's duration, from its
    start to its goal, and multipliers (S + 1, nq) [N·m] at the same shares; both are linear in
    between."""

    x: Array
    multipliers: Array

    @property
    def steps(self) -> int:
        """Number of steps S."""
        return len(self.x) - 1


def greatest_speed(limits: Limits, t: Array) -> Array:
    """Greatest speed (..., nq) [rad/s] at a time t (...) [s] after rest, under the limits on speed,
    acceleration and jerk: rest has no acceleration."""
    t, ramp = t[..., None], limits.a_max / limits.j_max
    rising = np.where(t < ramp, limits.j_max * t * t / 2, limits.a_max * (t - ramp / 2))
    return np.asarray(np.minimum(rising, limits.v_max))


def half_sides(reference: Reference, limits: Limits, longest: float) -> Array:
    """Half sides (S, nq) [rad] of boxes around the path that hold every motion of at most `longest`
    [s] in each step.

    In the time from the start no joint gets farther than `greatest_speed` takes it, nor can it be
    farther from the goal than that takes it in the time left. Position limits hold.
    """
    x, S = reference.x, reference.steps
    time = longest * np.arange(S + 1) / S
    far = np.concatenate(
        [
            np.zeros((1, x.shape[1])),
            np.cumsum(greatest_speed(limits, time[1:]), axis=0) * longest / S,
        ]
    )
    # of a step the end counts from the start, and the beginning counts from the goal
    after, before = far[1:], far[::-1][:-1]
    high = np.minimum(np.minimum(x[0] + after, x[-1] + before), limits.q_max)
    low = np.maximum(np.maximum(x[0] - after, x[-1] - before), limits.q_min)
    ends = np.stack([x[:-1], x[1:]])
    return np.asarray(
        np.maximum((high - ends).max(axis=0), (ends - low).max(axis=0)).clip(_LEAST_HALF)
    )
