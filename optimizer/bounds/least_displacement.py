"""How far joints must move between boxes of joint positions, with what full turns the position
limits leave.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Limits, Mask

# what position limits are widened by, for rounding [rad]
ROUNDING = 1e-9


def least_displacement(
    limits: Limits, start: Array, start_half: Array, goal: Array, goal_half: Array, given: bool
) -> tuple[Array, Mask]:
    """The least displacement (n, nq) [rad] of each joint from boxes around `start` into boxes
    around `goal` (n, nq), and which (n,) pairs of boxes have any within the limits.

    A box counts with every full turn of a joint that brings a part of it within the limits. Starts
    that are `given` stand as they are.
    """
    starts = (
        [(start, np.ones(start.shape, dtype=bool))] if given else turned(start, start_half, limits)
    )
    least = np.full(np.broadcast_shapes(start.shape, goal.shape), np.inf)
    half = start_half + goal_half
    for to, reached in turned(goal, goal_half, limits):
        for source, left in starts:
            away = np.maximum(np.abs(to - source) - half, 0.0)
            least = np.where(reached & left, np.minimum(least, away), least)
    possible = np.isfinite(least).all(axis=1)
    return np.where(np.isfinite(least), least, 0.0), np.asarray(possible)


def turned(q: Array, half: Array, limits: Limits) -> list[tuple[Array, Mask]]:
    """Boxes (n, nq) with every full turn that may bring some of them within limits, and which parts
    (n, nq) it does.
    """
    q_min, q_max = limits.q_min - ROUNDING, limits.q_max + ROUNDING
    least = np.ceil((q_min - half - q) / (2 * np.pi))
    most = np.floor((q_max + half - q) / (2 * np.pi))
    turns = range(int(least.min(initial=0.0)), int(most.max(initial=0.0)) + 1)
    return [(q + 2 * np.pi * turn, (least <= turn) & (turn <= most)) for turn in turns]
