"""What is odd in a log, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.logs.columns import Columns
from joulepath.optimizer.identify.logs.grid import Grid
from joulepath.optimizer.identify.logs.log import Log

_SATURATED, _LEAST_SATURATED = 0.005, 10
"""Fraction and number of moving rows at exactly the greatest effort beyond which it is cut off
there.
"""
_NEIGHBOURS = 5
"""Rows among which one or two are a spike."""
_LEAPS, _OF_NOISE = {"effort": 0.8, "power": 0.3}, 10.0
"""Of the range of a channel, and of its noise, that a spike is away from its neighbours; friction
makes steps of the efforts of small joints."""
_MOVING, _HELD = 0.05, 0.7  # rad/s
"""Fraction of moving rows with the values of the row before beyond which a channel is written again
and again.
"""


def log_warnings(log: Log, grid: Grid, columns: Columns) -> list[str]:
    """Gaps, repeated times, constant or saturated channels, spikes, what the log does not say."""
    found = [*_times(grid), *_constant(log), *_saturated(log), *_spikes(log)]
    if not log.payload_known:
        found.append("No payload is given or logged: the arm is taken to have carried nothing.")
    if columns.form == "ros" and any(name.rstrip("]")[-1:].isdigit() for name in columns.names):
        found.append(
            "The joints are taken in the order of their numbers, from base to flange: drivers of "
            "ROS may publish them "
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
    if grid.unit != "s":
        yield (
            f"The times are taken for {grid.unit}: no other unit makes a rate of them that a "
            "log has."
        )
    if grid.repeated:
        yield (
            f"Rows with the time of the row before: {grid.repeated}. The first row of each time "
            "counts."
        )


def _constant(log: Log) -> Iterator[str]:
    for words, values in (
        ("position", log.q),
        ("effort", log.effort),
        ("temperature", log.temperature),
    ):
        if values is None:
            continue
        same = np.flatnonzero(np.ptp(values, axis=0) == 0)
        if same.size:
            yield f"The {words} of joints {numbers_of_joints(same)} never changes."
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
        yield (
            f"The effort of joints {numbers_of_joints(wrong)} stays at its greatest value: it "
            "is cut off there."
        )


def _cut_off(effort: Array, moving: Mask) -> bool:
    size = np.abs(effort[moving])
    if not size.size or np.ptp(effort) == 0:
        return False
    return int((size == size.max()).sum()) > max(_LEAST_SATURATED, _SATURATED * len(size))


def _spikes(log: Log) -> Iterator[str]:
    for words, values in _measured(log):
        rows = np.zeros(len(values), dtype=bool)
        for channel in values.T:
            rows |= _leaps(channel, _LEAPS[words])
        if rows.any():
            yield (
                f"The {words} has spikes in {rows.sum()} rows, the first at "
                f"{log.time[int(np.argmax(rows))]:.4g} s: "
                "delete these rows, or identify with estimator=irls, which gives outliers less "
                "weight."
            )


def _measured(log: Log) -> Iterator[tuple[str, Array]]:
    if log.effort is not None:
        yield "effort", log.effort
    if log.power is not None:
        yield "power", log.power[:, None]


def _leaps(channel: Array, share: float) -> Mask:
    """Where a channel (n,) is farther from the median of its neighbours than a share of the range
    of these medians.
    """
    # every process that serves requests would hold it, and only logs are filtered
    from scipy.ndimage import median_filter

    middle = median_filter(channel, _NEIGHBOURS)
    low, high = np.percentile(middle, [1, 99])
    away = np.abs(channel - middle)
    return np.asarray(away > max(share * (high - low), _OF_NOISE * float(np.median(away)), 1e-9))


def held_warning(words: str, values: Array, v: Array, rate: float) -> list[str]:
    """What is said of a channel (n, k) that hardly ever changes while joints move at v (n, joints)
    [rad/s].
    """
    moving = np.flatnonzero((np.abs(v[1:]) > _MOVING).any(axis=1)) + 1
    changes = sum(
        int((values[part] != values[part - 1]).any(axis=1).sum())
        for part in np.array_split(moving, 16)
    )
    if not 0 < changes < (1 - _HELD) * len(moving):
        return []
    return [
        f"The {words} changes only every {len(moving) / changes / rate:.2g} s while the arm moves: "
        "it is measured less "
        "often than it is written. Log at the rate at which it is measured."
    ]


def numbers_of_joints(joints: Iterable[int]) -> str:
    """Joints, as a sentence names them: from 1."""
    return ", ".join(str(j + 1) for j in joints)
