"""What is odd in a log, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from models.robot import Array, Mask
from optimizer.identification.logs.columns import Columns
from optimizer.identification.logs.grid import Grid
from optimizer.identification.logs.log import Log

_SATURATED, _LEAST_SATURATED = 0.005, 10
"""Fraction and number of moving rows at exactly the greatest effort beyond which it is cut off there."""
_NEIGHBOURS = 5
"""Rows among which one or two are a spike."""


def log_warnings(log: Log, grid: Grid, columns: Columns, misfits: Sequence[int]) -> list[str]:
    """Gaps, repeated times, constant or saturated channels, spikes, what the log does not say; joints `misfits` have
    speeds that do not fit."""
    found = [*_times(grid), *_constant(log), *_saturated(log), *_spikes(log)]
    if misfits:
        found.append(
            f"The speeds of joints {_numbers(misfits)} do not fit their positions: check units, signs and the order of "
            "the columns."
        )
    if not log.payload_known:
        found.append("No payload is given or logged: the arm is taken to have carried nothing.")
    if columns.form == "ros" and any(name.rstrip("]")[-1:].isdigit() for name in columns.names):
        found.append(
            "The joints are taken in the order of their numbers, from base to flange: drivers of ROS may publish them "
            "in another one. Then name the columns in `columns`."
        )
    return found


def _times(grid: Grid) -> Iterator[str]:
    if len(grid.gaps):
        lengths = np.diff(grid.gaps, axis=1) / grid.rate
        yield (
            f"Gaps in the log: {len(grid.gaps)}, the longest of {lengths.max():.3g} s at "
            f"{grid.time[grid.gaps[lengths.argmax(), 0]]:.3g} s. No move reaches across one."
        )
    if grid.repeated:
        yield f"Rows with the time of the row before: {grid.repeated}. The first row of each time counts."


def _constant(log: Log) -> Iterator[str]:
    for words, values in (("position", log.q), ("effort", log.effort), ("temperature", log.temperature)):
        if values is None:
            continue
        same = np.flatnonzero(np.ptp(values, axis=0) == 0)
        if same.size:
            yield f"The {words} of joints {_numbers(same)} never changes."
    if log.power is not None and np.ptp(log.power) == 0:
        yield "The power never changes."


def _saturated(log: Log) -> Iterator[str]:
    if log.effort is None:
        return
    moving = np.zeros(len(log.effort), dtype=bool)
    for move in log.moves:
        moving[move.start : move.end] = not move.at_rest
    # joint by joint: a log can fill half of the memory
    wrong = [joint for joint, effort in enumerate(log.effort.T) if _cut_off(effort, moving)]
    if wrong:
        yield f"The effort of joints {_numbers(wrong)} stays at its greatest value: it is cut off there."


def _cut_off(effort: Array, moving: Mask) -> bool:
    size = np.abs(effort[moving])
    if not size.size or np.ptp(effort) == 0:
        return False
    return int((size == size.max()).sum()) > max(_LEAST_SATURATED, _SATURATED * len(size))


def _spikes(log: Log) -> Iterator[str]:
    for words, values in (("effort", log.effort), ("power", None if log.power is None else log.power[:, None])):
        if values is None:
            continue
        rows = np.zeros(len(values), dtype=bool)
        for channel in values.T:
            rows |= _leaps(channel)
        if rows.any():
            yield (
                f"The {words} has spikes in {rows.sum()} rows, the first at {log.time[int(np.argmax(rows))]:.4g} s: "
                "delete these rows, or identify with estimator=irls, which gives outliers less weight."
            )


def _leaps(channel: Array) -> Mask:
    """Where a channel (n,) is farther from the median of its neighbours than nearly all of it is spread."""
    # every process that serves requests would hold it, and only logs are filtered
    from scipy.ndimage import median_filter

    low, high = np.percentile(channel, [1, 99])
    return np.asarray(np.abs(channel - median_filter(channel, _NEIGHBOURS)) > max(high - low, 1e-9))


def _numbers(joints: Iterable[int]) -> str:
    return ", ".join(str(j + 1) for j in joints)
