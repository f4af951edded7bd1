"""Joint positions shifted by full turns into limits."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, tau

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.kinematics.reach import REACH


def full_turn_alternatives(q: Array, q_min: Array, q_max: Array) -> list[list[float]]:
    """Angles q + 2πk [rad] of the joints within their limits, nearest to zero first.

    An angle beyond a limit by rounding is moved onto the limit.

    Args:
        q: joint positions (nq,) [rad].
        q_min: lower limits (nq,) [rad].
        q_max: upper limits (nq,) [rad].
    """
    choices = []
    for angle, lower, upper in zip(q.tolist(), q_min.tolist(), q_max.tolist(), strict=True):
        least = ceil((lower - REACH.rounding_angle - angle) / tau)
        most = floor((upper + REACH.rounding_angle - angle) / tau)
        inside = (min(max(angle + tau * k, lower), upper) for k in range(least, most + 1))
        choices.append(sorted(inside, key=abs))
    return choices


def nearest_turns(q: Array, limits: Limits) -> tuple[Array, Sequence[bool]]:
    """First of the `full_turn_alternatives` of every joint.

    Args:
        q: configurations (n, nq) [rad] in [-π, π].
        limits: position limits.

    Returns:
        The configurations (n, nq) [rad], and per row whether all joints are within the limits.
    """
    if len(q) and (limits.q_min <= q.min(axis=0)).all() and (q.max(axis=0) <= limits.q_max).all():
        return q, [True] * len(q)
    least = np.ceil((limits.q_min - REACH.rounding_angle - q) / tau)
    most = np.floor((limits.q_max + REACH.rounding_angle - q) / tau)
    # np.clip takes five times as long for so few numbers.
    turns = np.minimum(np.maximum(least, 0.0), np.maximum(most, least))
    near = np.minimum(np.maximum(q + tau * turns, limits.q_min), limits.q_max)
    near.setflags(write=False)
    held: Mask = np.asarray((least <= most).all(axis=1))
    return near, held.tolist()
