"""Which moves run along the same motion: they must not stand on both sides of a split.

Moves are the same if their ends are, in either direction. A log that never rests is cut into blocks
anywhere: a block is the same as another move if most of its states are close to states of that.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from joulepath.models.robot import Array, Mask

Numbers = npt.NDArray[np.int64]

# rad; positions this close are the same. A speed of 1 rad/s counts as so many rad
CLOSE, TIME = 0.05, 0.1
# share of the states of a move that are close to another's
MOST_STATES = 0.5
# share of a move's greatest speed
IN_MOTION = 0.5
# of all moves together that are compared
MOST_COMPARED = 4000


def groups_of_motions(q: Array, v: Array, move: Numbers, rest: Mask) -> Numbers:
    """The group (n,) of every row: moves (n,) along the same motion share one. q (n, nq) [rad], v
    (n, nq) [rad/s].
    """
    moving = np.flatnonzero(~rest)
    count = int(move.max()) + 1
    pairs = [
        *_same_ends(q[moving], move[moving]),
        *_same_states(q[moving], v[moving], move[moving]),
    ]
    links = np.array(pairs, dtype=int).reshape(-1, 2)
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=int)[move]


def _same_ends(q: Array, move: Numbers) -> list[tuple[int, int]]:
    """Pairs of moves with the same ends, in either direction."""
    numbers, first = np.unique(move, return_index=True)
    last = np.append(first[1:], len(move)) - 1
    if len(numbers) < 2:
        return []
    ahead, back = np.hstack([q[first], q[last]]), np.hstack([q[last], q[first]])
    tree = cKDTree(ahead)
    found = [*tree.query_pairs(CLOSE, p=np.inf)]
    for one, near in enumerate(tree.query_ball_point(back, CLOSE, p=np.inf)):
        found += [(one, other) for other in near]
    return [(int(numbers[one]), int(numbers[other])) for one, other in found]


def _same_states(q: Array, v: Array, move: Numbers) -> list[tuple[int, int]]:
    """Pairs of moves of which most states of one are close to states of the other."""
    chosen = slice(None, None, max(1, len(q) // MOST_COMPARED))
    moves = move
    states, move = np.hstack([q, TIME * v])[chosen], move[chosen]
    size = np.bincount(move, minlength=int(moves.max(initial=-1)) + 1)
    near = cKDTree(states).query_ball_point(states, CLOSE, p=np.inf)
    met = np.zeros((len(size), len(size)))
    for own, others in zip(move, near, strict=True):
        met[own, np.unique(move[others])] += 1
    same = np.argwhere(met > MOST_STATES * np.maximum(size, 1)[:, None])
    block = _begin_or_end_in_motion(v, moves)
    return [
        (int(one), int(other))
        for one, other in same
        if one != other and (block[one] or block[other])
    ]


def _begin_or_end_in_motion(v: Array, move: Numbers) -> Mask:
    """Which moves (moves,) begin or end faster than any that comes from rest or goes to it does."""
    found = np.zeros(int(move.max(initial=-1)) + 1, dtype=bool)
    for number in np.unique(move):
        speed = np.abs(v[move == number]).max(axis=1)
        found[number] = max(speed[0], speed[-1]) > IN_MOTION * speed.max()
    return found
