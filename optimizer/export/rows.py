"""Times of the rows of a table, at a fixed period."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.problem.scalars import check_within


@dataclass(frozen=True)
class TableLimits:
    """Limits of a table."""

    max_rows: int = 100_000
    """Largest number of rows: some ten megabytes."""
    min_remainder: float = 1e-6
    """Remainder of the last period, up to which its beginning counts as the end [s]."""


TABLE = TableLimits()


@dataclass(frozen=True)
class TableOptions:
    """Options of `csv` and `npz`."""

    period: float = 0.008
    """Time between two rows [s]."""

    def __post_init__(self) -> None:
        check_period(self.period)


def check_period(period: float) -> None:
    """Check the period of a table [s]. Raises InvalidProblem if it is out of range."""
    check_within("period", period, OPTION_RANGES.period, "seconds")


def times(program: Program, period: float, format: str, most: int = TABLE.max_rows) -> Array:
    """Multiples of a period from 0 on, and the end of a program [s].

    Args:
        program: the motion.
        period: the period [s].
        format: name of the format in error messages.
        most: largest number of rows.

    Raises:
        FormatUnsuitable: there are too many rows.
    """
    before_end = math.ceil((program.duration - TABLE.min_remainder) / period)
    _check_count(before_end + 1, format, most)
    return np.append(np.arange(before_end) * period, program.duration)


def ticks(program: Program, period: float, format: str, most: int = TABLE.max_rows) -> Array:
    """Multiples of a period from 0 to the first one at or after the end of a program [s].

    Arguments and errors are those of `times`.
    """
    count = math.ceil((program.duration - TABLE.min_remainder) / period) + 1
    _check_count(count, format, most)
    return np.asarray(np.arange(count) * period, dtype=float)


def _check_count(count: int, format: str, most: int) -> None:
    if count > most:
        raise FormatUnsuitable(
            format,
            f"The file would have {count} rows, and {format} has at most {most}: export it with a "
            "longer period, with a larger speed_scale, or move by move.",
        )
