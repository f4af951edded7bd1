"""Least displacement of joints between boxes of joint positions, over all allowed full turns."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array, Limits, Mask

LIMIT_TOLERANCE = 1e-9
"""Distance [rad] by which position limits are widened for rounding."""


def least_displacement(
    limits: Limits, start: Array, start_half: Array, goal: Array, goal_half: Array, given: bool
) -> tuple[Array, Mask]:
    """Least displacement of each joint from boxes at the start into boxes at the goal.

    A box counts with every full turn of a joint that brings a part of the box within the limits.

    Args:
        limits: limits with the position limits.
        start: middles of the boxes at the start, shape (n, nq) [rad].
        start_half: half sides of the boxes at the start, shape (n, nq) [rad].
        goal: middles of the boxes at the goal, shape (n, nq) [rad].
        goal_half: half sides of the boxes at the goal, shape (n, nq) [rad].
        given: whether the starts count without other full turns.

    Returns:
        Displacements (n, nq) [rad], and whether a pair of boxes has any within the limits (n,).
    """
    starts = [(start, np.ones(start.shape, dtype=bool))]
    if not given:
        starts = full_turns(start, start_half, limits)
    least = np.full(np.broadcast_shapes(start.shape, goal.shape), np.inf)
    half = start_half + goal_half
    for target, target_allowed in full_turns(goal, goal_half, limits):
        for source, source_allowed in starts:
            displacement = np.maximum(np.abs(target - source) - half, 0.0)
            allowed = target_allowed & source_allowed
            least = np.where(allowed, np.minimum(least, displacement), least)
    possible = np.isfinite(least).all(axis=1)
    return np.where(np.isfinite(least), least, 0.0), np.asarray(possible)


def full_turns(q: Array, half: Array, limits: Limits) -> list[tuple[Array, Mask]]:
    """Boxes with every full turn of their joints that may bring some box within the limits.

    Args:
        q: middles of the boxes, shape (n, nq) [rad].
        half: half sides of the boxes, shape (n, nq) [rad].
        limits: limits with the position limits.

    Returns:
        For each full turn, the middles (n, nq) [rad] and whether it is allowed (n, nq).
    """
    q_min, q_max = limits.q_min - LIMIT_TOLERANCE, limits.q_max + LIMIT_TOLERANCE
    least = np.ceil((q_min - half - q) / (2 * np.pi))
    most = np.floor((q_max + half - q) / (2 * np.pi))
    turns = range(int(least.min(initial=0.0)), int(most.max(initial=0.0)) + 1)
    return [(q + 2 * np.pi * turn, (least <= turn) & (turn <= most)) for turn in turns]
