"""Cuts a log into moves and rests; moves are the unit of the split for validation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.identify.logs.filters import low_passed, noise
from joulepath.optimizer.identify.logs.log import LogMove


@dataclass(frozen=True)
class MoveSettings:
    """Settings of the cut into moves and rests."""

    min_duration: float = 0.1
    """Duration below which a move counts as noise in a rest [s]."""
    max_duration: float = 8.0
    """Duration above which a move is divided into blocks [s]; otherwise a log of a long excitation
    would be a single move."""
    block_duration: float = 5.0
    """Approximate duration of a block [s]."""
    block_gap: float = 0.5
    """Time left out between two blocks, which are correlated [s]."""
    rest_command: float = 1e-4
    """Commanded speed below which a joint rests [rad/s]."""
    rest_speed: float = 0.01
    """Measured speed below which a joint rests [rad/s]."""
    noise_ratio: float = 4.0
    """Speed over its noise, below which a joint rests [1]."""
    min_rest: float = 0.05
    """Smallest duration of a rest by measured speed [s]; speeds also cross zero in motion."""


MOVES = MoveSettings()


def rests_by_command(commanded: Array) -> Mask:
    """Whether the arm rests (n,), by commanded speeds (n, joints) [rad/s]."""
    return np.asarray((np.abs(commanded) < MOVES.rest_command).all(axis=1))


def rests_by_speed(v: Array, rate: float) -> Mask:
    """Whether the arm rests (n,), by low-passed speeds v (n, joints) [rad/s] and their noise."""
    still = np.ones(len(v), dtype=bool)
    for channel in np.split(v, v.shape[1], axis=1):
        threshold = max(MOVES.rest_speed, MOVES.noise_ratio * float(noise(channel, rate)[0]))
        still &= np.abs(low_passed(channel, rate)[:, 0]) < threshold
    for start, end in _runs(still, True):
        if end - start < MOVES.min_rest * rate:
            still[start:end] = False
    return still


def cut_into_moves(still: Mask, rate: float, gaps: Indices) -> tuple[LogMove, ...]:
    """Moves and rests in the order of time; none extends across a gap.

    Args:
        still: whether the arm rests (n,).
        rate: rate of the rows [Hz].
        gaps: rows (k, 2) before and after each gap.
    """
    still = still.copy()
    for start, end in _runs(still, False):
        if end - start < MOVES.min_duration * rate:
            still[start:end] = True
    edges = [0, *(int(row) for row in gaps.ravel()), len(still)]
    parts = zip(edges[::2], edges[1::2], strict=True)
    return tuple(
        move
        for low, high in parts
        for move in _moves_between(still, low, min(high + 1, len(still)), rate)
    )


def _moves_between(still: Mask, low: int, high: int, rate: float) -> Iterator[LogMove]:
    changes = [low, *(low + 1 + np.flatnonzero(np.diff(still[low:high]))).tolist(), high]
    for start, end in pairwise(changes):
        if start == end:
            continue
        if still[start] or end - start <= MOVES.max_duration * rate:
            yield LogMove(start, end, bool(still[start]))
        else:
            yield from _blocks(start, end, rate)


def _blocks(start: int, end: int, rate: float) -> Iterator[LogMove]:
    """Blocks of equal length, with gaps between them."""
    duration, gap = (end - start) / rate, MOVES.block_gap
    count = max(2, round((duration + gap) / (MOVES.block_duration + gap)))
    length = (duration - (count - 1) * gap) / count
    for k in range(count):
        first = start + round(k * (length + gap) * rate)
        yield LogMove(first, min(first + round(length * rate), end), False)


def _runs(mask: Mask, value: bool) -> list[tuple[int, int]]:
    """Ranges of rows with one value of a mask (n,), as start and exclusive end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask == value, [False]])))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
