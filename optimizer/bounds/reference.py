"""The reference path and multipliers of a dual bound, and boxes around all motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits

LEAST_HALF_SIDE = 1e-6
"""Least half side of the boxes around a path [rad]; the grid needs an extent in every joint."""


@dataclass(frozen=True)
class Reference:
    """A path from start to goal with multipliers, linear on S equal steps of time."""

    x: Array
    """Positions at the nodes, shape (S + 1, nq) [rad]."""
    multipliers: Array
    """Multipliers λ at the nodes, shape (S + 1, nq) [N·m]."""

    @property
    def steps(self) -> int:
        """Number of steps S."""
        return len(self.x) - 1


def greatest_speed(limits: Limits, t: Array) -> Array:
    """Greatest speed at a time after rest, shape (..., nq) [rad/s].

    The acceleration at rest is zero.

    Args:
        limits: limits on speed, acceleration and jerk.
        t: time after rest, shape (...) [s].
    """
    t, ramp = t[..., None], limits.a_max / limits.j_max
    rising = np.where(t < ramp, limits.j_max * t * t / 2, limits.a_max * (t - ramp / 2))
    return np.asarray(np.minimum(rising, limits.v_max))


def half_sides(reference: Reference, limits: Limits, longest: float) -> Array:
    """Half sides of boxes around a path that contain every motion, shape (S, nq) [rad].

    The boxes follow from the distance travelled at `greatest_speed` from the start or to the goal,
    and from the position limits.

    Args:
        reference: path.
        limits: limits of the joints.
        longest: longest duration of the motions [s].
    """
    x, S = reference.x, reference.steps
    time = longest * np.arange(S + 1) / S
    far = np.concatenate(
        [
            np.zeros((1, x.shape[1])),
            np.cumsum(greatest_speed(limits, time[1:]), axis=0) * longest / S,
        ]
    )
    # the farthest position from the start is at the end of a step, from the goal at its beginning
    after, before = far[1:], far[::-1][:-1]
    high = np.minimum(np.minimum(x[0] + after, x[-1] + before), limits.q_max)
    low = np.maximum(np.maximum(x[0] - after, x[-1] - before), limits.q_min)
    ends = np.stack([x[:-1], x[1:]])
    return np.asarray(
        np.maximum((high - ends).max(axis=0), (ends - low).max(axis=0)).clip(LEAST_HALF_SIDE)
    )
