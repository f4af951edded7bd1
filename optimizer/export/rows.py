"""Sampling times of a program at a fixed period, for formats that are tables."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.program import Program

MOST_ROWS = 100_000
"""Most rows of a table: some ten megabytes."""
# what is left of the last period [s], below which its beginning counts as the end
SHORTEST_ROW = 1e-6


@dataclass(frozen=True)
class TableOptions:
    """Options of `csv` and `npz`: `period` [s] is the time between two rows."""

    period: float = 0.008


def times(program: Program, period: float, format: str, most: int = MOST_ROWS) -> Array:
    """Multiples of the period [s] from 0 on, and the end. Raises FormatUnsuitable if they are too
    many.
    """
    before_end = math.ceil((program.duration - SHORTEST_ROW) / period)
    _check_count(before_end + 1, format, most)
    return np.append(np.arange(before_end) * period, program.duration)


def ticks(program: Program, period: float, format: str, most: int = MOST_ROWS) -> Array:
    """Multiples of the period [s] from 0 to the end, or to the first one after it. Raises
    FormatUnsuitable if they are too many."""
    count = math.ceil((program.duration - SHORTEST_ROW) / period) + 1
    _check_count(count, format, most)
    return np.asarray(np.arange(count) * period, dtype=float)


def _check_count(count: int, format: str, most: int) -> None:
    if count > most:
        raise FormatUnsuitable(
            format,
            f"The file would have {count} rows, and {format} has at most {most}: export it with a "
            "longer period, "
            "with a larger speed_scale, or move by move.",
        )
