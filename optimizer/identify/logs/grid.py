"""The times of a log, and its channels on the uniform grid of its rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.exceptions import InvalidTable

LEAST_RATE, MOST_RATE = 20.0, 10_000.0
"""Rates [Hz] that are read."""
LEAST_ROWS = 32
"""Least rows of a log: its filter needs some."""
MOST_REPEATED = 0.2
"""Greatest fraction of repeated times: beyond it, the times are too coarse to say when a row was
measured.
"""
GAP = 5.0
"""Steps [median steps] from which on a step is a gap."""
_REGULAR = (
    1.8  # steps [median steps] up to which a step counts in the mean: no row is missing in it
)
_UNIFORM = 1e-3  # deviation [steps] from the grid up to which rows are taken as they are
_MOST_GROWTH = 2.0  # rows of the grid for each row of the log
_LATEST = 1e12  # |time| [s]
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}
"""Units that times may have, in s."""
_PIECE = 16384  # rows of the grid that a spline is evaluated at
# rows of the log beside them: what is farther away changes a cubic spline by less than rounding
_BESIDE = 32


@dataclass(frozen=True)
class Grid:
    """A uniform grid `time` (n,) [s] from 0 with `rate` [Hz] for rows at times `at` (m,) [s].

    `kept` are the indices of these rows in the log; `gaps` (k, 2) are rows of the grid: the last
    one before a gap and the first one behind it. `jitter` [s]: P5 and P95 of the steps' deviation
    from 1 / rate. `repeated` counts dropped rows with the time of the row before. `uniform`: the
    rows are the grid's. `unit` is that of the times in the file.
    """

    time: Array
    rate: float
    at: Array
    kept: Indices
    gaps: Indices
    jitter: tuple[float, float]
    repeated: int
    uniform: bool
    unit: str = "s"

    def resampled(self, values: Array, smooth: bool = False) -> Array:
        """Channels (m, k) of the rows on the grid (n, k), linear in between, or if `smooth` by
        cubic splines.
        """
        if self.uniform:
            return np.ascontiguousarray(values)
        result = np.empty((len(self.time), values.shape[1]), values.dtype)
        if not smooth:
            for k, column in enumerate(values.T):
                result[:, k] = np.interp(self.time, self.at, column)
            return result
        # piece by piece: the spline of a long log would need more memory than the log
        for start in range(0, len(self.time), _PIECE):
            time = self.time[start : start + _PIECE]
            low, high = np.searchsorted(self.at, time[[0, -1]]).tolist()
            rows = slice(max(low - _BESIDE, 0), high + _BESIDE)
            result[start : start + _PIECE] = CubicSpline(self.at[rows], values[rows])(time)
        return result


def grid_of(t: Array, rows: Array, column: str) -> Grid:
    """The grid for times t (m,) in lines `rows` (m,) of a file, from its column `column`. Raises
    InvalidTable.

    They are in seconds, or in the unit that makes a rate of them that is read: no two units do.
    """
    t, unit = _seconds(t, rows, column)
    steps = np.diff(t)
    if (steps < 0).any():
        row = int(rows[int(np.argmax(steps < 0)) + 1])
        raise InvalidTable(
            f"{column} goes back in line {row}: a log is one recording, in the order of time.",
            row,
            column,
        )
    fresh = np.flatnonzero(np.append(True, steps > 0))
    repeated = len(t) - len(fresh)
    if repeated > MOST_REPEATED * len(t):
        raise InvalidTable(
            f"{column} repeats itself in {repeated} of {len(t)} rows: write times with more "
            "digits.",
            None,
            column,
        )
    if len(fresh) < LEAST_ROWS:
        raise InvalidTable(f"The log has {len(fresh)} rows: it needs {LEAST_ROWS} or more.")
    at = t[fresh] - t[0]
    steps = np.diff(at)
    median = float(np.median(steps))
    step = float(steps[steps <= _REGULAR * median].mean())
    rate = 1 / step
    if not LEAST_RATE * 0.99 <= rate <= MOST_RATE * 1.01:
        raise InvalidTable(
            f"The log has {rate:.4g} rows per second of {column}: give times in seconds, and "
            f"{LEAST_RATE:g} to "
            f"{MOST_RATE:g} rows per second.",
            None,
            column,
        )
    count = round(float(at[-1]) / step) + 1
    if count > _MOST_GROWTH * len(fresh):
        worst = int(steps.argmax())
        row = int(rows[fresh[worst + 1]])
        raise InvalidTable(
            f"More than half of the log is missing, {steps[worst]:.4g} s before line {row} alone: "
            "divide it there.",
            row,
            column,
        )
    behind = np.flatnonzero(steps > GAP * median)
    edges = np.stack([np.floor(at[behind] / step), np.ceil(at[behind + 1] / step)], axis=1)
    uniform = len(fresh) == count and bool(np.abs(at / step - np.arange(count)).max() < _UNIFORM)
    low, high = np.percentile(steps - step, [5, 95])
    return Grid(
        time=np.arange(count, dtype=float) * step,
        rate=rate,
        at=at,
        kept=fresh,
        gaps=edges.astype(int),
        jitter=(float(low), float(high)),
        repeated=repeated,
        uniform=uniform,
        unit=unit,
    )


def _seconds(t: Array, rows: Array, column: str) -> tuple[Array, str]:
    """Times t (m,) in seconds, and the unit that they are in by their median step. Raises
    InvalidTable.
    """
    steps, unit = np.diff(t), "s"
    steps = steps[steps > 0]
    if steps.size:
        rate = 1 / float(np.median(steps))
        read = [
            name
            for name, size in TIME_UNITS.items()
            if LEAST_RATE * 0.99 <= rate / size <= MOST_RATE * 1.01
        ]
        unit = read[0] if read else "s"
    t = t if unit == "s" else t * TIME_UNITS[unit]
    if np.abs(t).max() > _LATEST:
        at = int(np.abs(t).argmax())
        raise InvalidTable(
            f"{column} in line {rows[at]:.0f} is too large: give times in seconds.",
            int(rows[at]),
            column,
        )
    return t, unit
