"""Cuts a log into moves and rests. Moves are the unit in which logs are divided for validation."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.identify.logs.filters import low_passed, noise
from joulepath.optimizer.identify.logs.log import LogMove

SHORTEST = 0.1
"""A shorter move [s] is noise, and rest."""
LONGEST = 8.0
"""A longer move [s] is divided into blocks: else a log of a long excitation would have one move
only.
"""
BLOCK, PAUSE = 5.0, 0.5
"""Length of a block [s], about, and of what is left out between two [s]: neighbours are
correlated."""
STILL_COMMAND, STILL = 1e-4, 0.01
"""Speeds [rad/s] below which a joint is at rest: by the controller's command, and by its measured
speed.
"""
_OF_NOISE = 4.0  # speeds of so many times their noise are no motion
_LEAST_REST = 0.05  # s; measured speeds also cross zero while the arm moves


def still_by_command(commanded: Array) -> Mask:
    """Rows (n,) in which commanded speeds (n, joints) [rad/s] are zero."""
    return np.asarray((np.abs(commanded) < STILL_COMMAND).all(axis=1))


def still_by_speed(v: Array, rate: float) -> Mask:
    """Rows (n,) at rest for 0.05 s or more, by speeds v (n, joints) [rad/s], low-passed and against
    their noise.
    """
    still = np.ones(len(v), dtype=bool)
    for channel in np.split(v, v.shape[1], axis=1):
        least = max(STILL, _OF_NOISE * float(noise(channel, rate)[0]))
        still &= np.abs(low_passed(channel, rate)[:, 0]) < least
    for start, end in _runs(still, True):
        if end - start < _LEAST_REST * rate:
            still[start:end] = False
    return still


def cut(still: Mask, rate: float, gaps: Indices) -> tuple[LogMove, ...]:
    """Moves and rests of rows (n,) that are `still` or not, in their order; none reaches into one
    of `gaps` (k, 2).
    """
    still = still.copy()
    for start, end in _runs(still, False):
        if end - start < SHORTEST * rate:
            still[start:end] = True
    edges = [0, *(int(row) for row in gaps.ravel()), len(still)]
    parts = zip(edges[::2], edges[1::2], strict=True)
    return tuple(
        move
        for low, high in parts
        for move in _cut_part(still, low, min(high + 1, len(still)), rate)
    )


def _cut_part(still: Mask, low: int, high: int, rate: float) -> Iterator[LogMove]:
    changes = [low, *(low + 1 + np.flatnonzero(np.diff(still[low:high]))).tolist(), high]
    for start, end in pairwise(changes):
        if start == end:
            continue
        if still[start] or end - start <= LONGEST * rate:
            yield LogMove(start, end, bool(still[start]))
        else:
            yield from _blocks(start, end, rate)


def _blocks(start: int, end: int, rate: float) -> Iterator[LogMove]:
    """Blocks of equal length, with pauses between them."""
    duration = (end - start) / rate
    count = max(2, round((duration + PAUSE) / (BLOCK + PAUSE)))
    length = (duration - (count - 1) * PAUSE) / count
    for k in range(count):
        first = start + round(k * (length + PAUSE) * rate)
        yield LogMove(first, min(first + round(length * rate), end), False)


def _runs(mask: Mask, value: bool) -> list[tuple[int, int]]:
    """The ranges of rows, end exclusive, in which `mask` (n,) has that value."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask == value, [False]])))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
