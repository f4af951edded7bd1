"""Times of a log, and its channels on the uniform grid of its rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.exceptions import InvalidTable

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}
"""Units of times in s."""


@dataclass(frozen=True)
class GridSettings:
    """Requirements on the times of a log, and settings of its grid."""

    min_rate: float = 20.0
    """Smallest rate [Hz]."""
    max_rate: float = 10_000.0
    """Largest rate [Hz]."""
    rate_tolerance: float = 0.01
    """Relative tolerance of the limits of the rate [1]."""
    min_rows: int = 32
    """Smallest number of rows; the filter needs some."""
    max_repeated: float = 0.2
    """Largest share of repeated times; more are too coarse to date a row [1]."""
    gap_steps: float = 5.0
    """Time step over the median step, above which the step is a gap [1]."""
    regular_steps: float = 1.8
    """Time step over the median step, up to which no row is missing and the step counts in the
    mean [1]."""
    uniform_tolerance: float = 1e-3
    """Deviation from the grid over a time step, up to which rows are not resampled [1]."""
    max_growth: float = 2.0
    """Largest number of rows of the grid over that of the log [1]."""
    max_time: float = 1e12
    """Largest absolute time [s]."""
    spline_rows: int = 16384
    """Rows of the grid that are resampled at once."""
    spline_margin: int = 32
    """Rows of the log beside them; rows farther away change a cubic spline by less than rounding
    errors."""

    def has_rate(self, rate: float) -> bool:
        """Whether a rate [Hz] is within the limits."""
        low, high = 1 - self.rate_tolerance, 1 + self.rate_tolerance
        return self.min_rate * low <= rate <= self.max_rate * high


GRID = GridSettings()


@dataclass(frozen=True)
class Grid:
    """Uniform grid of n times for m rows of a log."""

    time: Array
    """Times of the grid (n,), from 0 [s]."""
    rate: float
    """Rate of the grid [Hz]."""
    at: Array
    """Times of the rows (m,) [s]."""
    kept: Indices
    """Indices of the rows in the log (m,)."""
    gaps: Indices
    """Rows of the grid (k, 2) before and after each gap."""
    jitter: tuple[float, float]
    """5th and 95th percentile of the deviation of a time step from 1 / rate [s]."""
    repeated: int
    """Number of dropped rows with the time of the previous row."""
    uniform: bool
    """Whether the rows are the rows of the grid."""
    unit: str = "s"
    """Unit of the times in the file."""

    def resampled(self, values: Array, smooth: bool = False) -> Array:
        """Resample channels (m, k) of the rows to the grid (n, k).

        Args:
            values: the channels.
            smooth: whether to interpolate by cubic splines instead of linearly.
        """
        if self.uniform:
            return np.ascontiguousarray(values)
        result = np.empty((len(self.time), values.shape[1]), values.dtype)
        if not smooth:
            for k, column in enumerate(values.T):
                result[:, k] = np.interp(self.time, self.at, column)
            return result
        # in pieces: the spline of a long log would need more memory than the log
        size, margin = GRID.spline_rows, GRID.spline_margin
        for start in range(0, len(self.time), size):
            time = self.time[start : start + size]
            low, high = np.searchsorted(self.at, time[[0, -1]]).tolist()
            rows = slice(max(low - margin, 0), high + margin)
            result[start : start + size] = CubicSpline(self.at[rows], values[rows])(time)
        return result


def grid_of(t: Array, rows: Array, column: str) -> Grid:
    """The grid of a log.

    Times are in seconds, or in the one unit that makes their rate an allowed rate.

    Args:
        t: times (m,).
        rows: numbers of their lines in the file (m,).
        column: name of the column of times.

    Raises:
        InvalidTable: the times do not meet a requirement.
    """
    t, unit = _seconds(t, rows, column)
    distinct = _distinct_times(t, rows, column)
    at = t[distinct] - t[0]
    steps = np.diff(at)
    median = float(np.median(steps))
    step = float(steps[steps <= GRID.regular_steps * median].mean())
    rate = 1 / step
    if not GRID.has_rate(rate):
        raise InvalidTable(
            f"The log has {rate:.4g} rows per second of {column}: give times in seconds, and "
            f"{GRID.min_rate:g} to {GRID.max_rate:g} rows per second.",
            None,
            column,
        )
    count = round(float(at[-1]) / step) + 1
    if count > GRID.max_growth * len(distinct):
        worst = int(steps.argmax())
        row = int(rows[distinct[worst + 1]])
        raise InvalidTable(
            f"More than half of the log is missing, {steps[worst]:.4g} s before line {row} "
            "alone: divide the log there.",
            row,
            column,
        )
    before_gap = np.flatnonzero(steps > GRID.gap_steps * median)
    edges = np.stack([np.floor(at[before_gap] / step), np.ceil(at[before_gap + 1] / step)], axis=1)
    low, high = np.percentile(steps - step, [5, 95])
    return Grid(
        time=np.arange(count, dtype=float) * step,
        rate=rate,
        at=at,
        kept=distinct,
        gaps=edges.astype(int),
        jitter=(float(low), float(high)),
        repeated=len(t) - len(distinct),
        uniform=len(distinct) == count
        and bool(np.abs(at / step - np.arange(count)).max() < GRID.uniform_tolerance),
        unit=unit,
    )


def _distinct_times(t: Array, rows: Array, column: str) -> Indices:
    """Indices of the times (m,) later than their predecessor.

    Raises:
        InvalidTable: times decrease, repeat too often, or are too few.
    """
    steps = np.diff(t)
    if (steps < 0).any():
        row = int(rows[int(np.argmax(steps < 0)) + 1])
        raise InvalidTable(
            f"{column} decreases in line {row}: a log is one recording, in the order of time.",
            row,
            column,
        )
    distinct = np.flatnonzero(np.append(True, steps > 0))
    repeated = len(t) - len(distinct)
    if repeated > GRID.max_repeated * len(t):
        raise InvalidTable(
            f"{column} repeats in {repeated} of {len(t)} rows: write times with more digits.",
            None,
            column,
        )
    if len(distinct) < GRID.min_rows:
        raise InvalidTable(f"The log has {len(distinct)} rows: it needs {GRID.min_rows} or more.")
    return distinct


def _seconds(t: Array, rows: Array, column: str) -> tuple[Array, str]:
    """Times (m,) in seconds, and their unit in the file.

    Raises:
        InvalidTable: a time is too large.
    """
    steps, unit = np.diff(t), "s"
    steps = steps[steps > 0]
    if steps.size:
        rate = 1 / float(np.median(steps))
        possible = [name for name, size in TIME_UNITS.items() if GRID.has_rate(rate / size)]
        unit = possible[0] if possible else "s"
    t = t if unit == "s" else t * TIME_UNITS[unit]
    if np.abs(t).max() > GRID.max_time:
        at = int(np.abs(t).argmax())
        raise InvalidTable(
            f"{column} in line {rows[at]:.0f} is too large: give times in seconds.",
            int(rows[at]),
            column,
        )
    return t, unit
