"""Groups of moves along the same motion, which must not stand on both sides of a split.

Moves are the same if their ends are, in either direction. A log that never rests is cut into blocks
at arbitrary times: a block is the same as another move if most of its states are close to states
of the other move.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.estimates.grouped import IntArray


@dataclass(frozen=True)
class SameMotionSettings:
    """Settings of the comparison of moves."""

    position_tolerance: float = 0.05
    """Largest distance of a joint between equal positions [rad]."""
    speed_scale: float = 0.1
    """Distance that a difference in speed of 1 rad/s counts as [s]."""
    min_state_share: float = 0.5
    """Share of the states of a move that must be close to states of the other move [1]."""
    min_end_speed: float = 0.5
    """Speed at an end, over the greatest speed of the move, above which a move begins or ends in
    motion [1]."""
    max_states: int = 4000
    """Largest number of states of all moves that are compared."""


SAME_MOTION = SameMotionSettings()


def groups_of_motions(q: Array, v: Array, move: IntArray, rest: Mask) -> IntArray:
    """Group of every row; moves along the same motion share one.

    Args:
        q: positions (n, nq) [rad].
        v: velocities (n, nq) [rad/s].
        move: move of every row (n,), from 0.
        rest: whether the arm rests (n,).

    Returns:
        Groups (n,), from 0.
    """
    moving = np.flatnonzero(~rest)
    count = int(move.max()) + 1
    pairs = [
        *_pairs_with_same_ends(q[moving], move[moving]),
        *_pairs_with_same_states(q[moving], v[moving], move[moving]),
    ]
    links = np.array(pairs, dtype=int).reshape(-1, 2)
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=int)[move]


def _pairs_with_same_ends(q: Array, move: IntArray) -> list[tuple[int, int]]:
    """Pairs of moves with the same ends, in either direction."""
    numbers, first = np.unique(move, return_index=True)
    last = np.append(first[1:], len(move)) - 1
    if len(numbers) < 2:
        return []
    forward, backward = np.hstack([q[first], q[last]]), np.hstack([q[last], q[first]])
    tree, tolerance = cKDTree(forward), SAME_MOTION.position_tolerance
    pairs = [*tree.query_pairs(tolerance, p=np.inf)]
    for one, others in enumerate(tree.query_ball_point(backward, tolerance, p=np.inf)):
        pairs += [(one, other) for other in others]
    return [(int(numbers[one]), int(numbers[other])) for one, other in pairs]


def _pairs_with_same_states(q: Array, v: Array, move: IntArray) -> list[tuple[int, int]]:
    """Pairs of moves, one of them in motion at an end, with mostly the same states."""
    cut = _cut_in_motion(v, move)
    if not cut.any():
        return []
    thinned = slice(None, None, max(1, len(q) // SAME_MOTION.max_states))
    move_of_state = move[thinned]
    states = np.hstack([q, SAME_MOTION.speed_scale * v])[thinned]
    size = np.bincount(move_of_state, minlength=int(move.max(initial=-1)) + 1)
    close = cKDTree(states).query_ball_point(states, SAME_MOTION.position_tolerance, p=np.inf)
    shared_states = np.zeros((len(size), len(size)))
    for own, others in zip(move_of_state, close, strict=True):
        shared_states[own, np.unique(move_of_state[others])] += 1
    same = np.argwhere(shared_states > SAME_MOTION.min_state_share * np.maximum(size, 1)[:, None])
    return [
        (int(one), int(other)) for one, other in same if one != other and (cut[one] or cut[other])
    ]


def _cut_in_motion(v: Array, move: IntArray) -> Mask:
    """Whether a move (moves,) begins or ends at speed, as no move from rest to rest does."""
    cut = np.zeros(int(move.max(initial=-1)) + 1, dtype=bool)
    for number in np.unique(move):
        speed = np.abs(v[move == number]).max(axis=1)
        cut[number] = max(speed[0], speed[-1]) > SAME_MOTION.min_end_speed * speed.max()
    return cut
