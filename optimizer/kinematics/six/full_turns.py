"""Joint positions that differ by full turns, within limits."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, tau

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.kinematics.six.ur_closed_form import ROUNDING


def full_turn_alternatives(q: Array, q_min: Array, q_max: Array) -> list[list[float]]:
    """Per joint, the angles q + 2πk [rad] within the limits, nearest to zero first; q, q_min, q_max
    (nq,).

    An angle that lies beyond a limit by rounding alone counts as on it.
    """
    choices = []
    for angle, lower, upper in zip(q.tolist(), q_min.tolist(), q_max.tolist(), strict=True):
        least, most = (
            ceil((lower - ROUNDING - angle) / tau),
            floor((upper + ROUNDING - angle) / tau),
        )
        inside = (min(max(angle + tau * k, lower), upper) for k in range(least, most + 1))
        choices.append(sorted(inside, key=abs))
    return choices


def nearest_turns(q: Array, limits: Limits) -> tuple[Array, Sequence[bool]]:
    """The first of `full_turn_alternatives` of every joint of q (n, nq) [rad] in [-π, π], and which
    rows (n,) have all."""
    if len(q) and (limits.q_min <= q.min(axis=0)).all() and (q.max(axis=0) <= limits.q_max).all():
        return q, [True] * len(q)
    least = np.ceil((limits.q_min - ROUNDING - q) / tau)
    most = np.floor((limits.q_max + ROUNDING - q) / tau)
    # np.clip takes five times as long for so few
    turns = np.minimum(np.maximum(least, 0.0), np.maximum(most, least))
    near = np.minimum(np.maximum(q + tau * turns, limits.q_min), limits.q_max)
    near.setflags(write=False)
    held: Mask = np.asarray((least <= most).all(axis=1))
    return near, held.tolist()
