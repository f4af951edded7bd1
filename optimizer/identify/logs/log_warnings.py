"""Warnings of doubtful properties of a log, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.identify.logs.columns import Columns
from joulepath.optimizer.identify.logs.grid import Grid
from joulepath.optimizer.identify.logs.log import Log


@dataclass(frozen=True)
class WarningSettings:
    """Settings of the warnings."""

    max_saturated_share: float = 0.005
    """Share of the rows in motion at exactly the largest effort, above which the effort is
    saturated [1]."""
    max_saturated_rows: int = 10
    """Number of these rows, above which the effort is saturated."""
    min_levels: int = 16
    """Number of values of a moving joint's effort, below which the effort has too few digits."""
    spike_neighbours: int = 5
    """Samples of the median that detects spikes."""
    effort_spike_share: float = 0.8
    """Distance of a spike of an effort from its neighbours over the range of the effort [1];
    friction makes steps in the efforts of small joints."""
    power_spike_share: float = 0.3
    """The same for the power [1]."""
    spike_noise_ratio: float = 10.0
    """Distance of a spike from its neighbours over the noise of the channel [1]."""
    moving_speed: float = 0.05
    """Speed above which a joint moves [rad/s]."""
    max_held_share: float = 0.7
    """Share of moving rows with the values of the previous row, above which a channel is written
    repeatedly [1]."""


WARNINGS = WarningSettings()


def log_warnings(log: Log, grid: Grid, columns: Columns) -> list[str]:
    """Warnings of gaps, repeated times, constant or saturated channels, spikes and missing
    information."""
    found = [*_times(grid), *_constant(log), *_saturated(log), *_spikes(log)]
    if not log.payload_known:
        found.append("No payload is given or logged: the payload is assumed to be zero.")
    if columns.format == "ros" and any(name.rstrip("]")[-1:].isdigit() for name in columns.names):
        found.append(
            "The joints are taken in the order of their numbers, from base to flange: ROS "
            "drivers may publish them in another order. If so, name the columns in `columns`."
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
        yield f"The times are read in {grid.unit}: no other unit gives a plausible rate."
    if grid.repeated:
        yield (
            f"Rows with the time of the previous row: {grid.repeated}. Only the first row of "
            "each time is used."
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
            yield f"The {words} of {named_joints(same)} never changes."
    if log.power is not None and np.ptp(log.power) == 0:
        yield "The power never changes."


def _saturated(log: Log) -> Iterator[str]:
    if log.effort is None:
        return
    moving = ~log.rests
    # joint by joint, because a log can fill half of the memory
    levels = [len(np.unique(effort[moving])) for effort in log.effort.T]
    coarse = [joint for joint, count in enumerate(levels) if 1 < count < WARNINGS.min_levels]
    if coarse:
        yield (
            f"The effort of {named_joints(coarse)} has fewer than {WARNINGS.min_levels} different "
            "values: its steps hide the friction. Log it with more digits."
        )
    wrong = [
        joint
        for joint, effort in enumerate(log.effort.T)
        if joint not in coarse and _is_saturated(effort, moving)
    ]
    if wrong:
        yield f"The effort of {named_joints(wrong)} is clipped at its largest value."


def _is_saturated(effort: Array, moving: Mask) -> bool:
    size = np.abs(effort[moving])
    if not size.size or np.ptp(effort) == 0:
        return False
    limit = max(WARNINGS.max_saturated_rows, WARNINGS.max_saturated_share * len(size))
    return int((size == size.max()).sum()) > limit


def _spikes(log: Log) -> Iterator[str]:
    channels = list[tuple[str, Array, float]]()
    if log.effort is not None:
        channels.append(("effort", log.effort, WARNINGS.effort_spike_share))
    if log.power is not None:
        channels.append(("power", log.power[:, None], WARNINGS.power_spike_share))
    for name, values, share in channels:
        rows = np.zeros(len(values), dtype=bool)
        for channel in values.T:
            rows |= _is_spike(channel, share)
        if rows.any():
            yield (
                f"The {name} has spikes in {rows.sum()} rows, the first at "
                f"{log.time[int(np.argmax(rows))]:.4g} s: delete these rows, or identify with "
                "estimator=irls, which gives outliers less weight."
            )


def _is_spike(channel: Array, share: float) -> Mask:
    """Whether samples (n,) differ from the median of their neighbours by a share of the range."""
    # imported late: only logs are filtered, and every serving process would hold it
    from scipy.ndimage import median_filter

    middle = median_filter(channel, WARNINGS.spike_neighbours)
    low, high = np.percentile(middle, [1, 99])
    distance = np.abs(channel - middle)
    by_noise = WARNINGS.spike_noise_ratio * float(np.median(distance))
    return np.asarray(distance > max(share * (high - low), by_noise, 1e-9))


def held_warning(name: str, values: Array, v: Array, rate: float) -> list[str]:
    """Warning of a channel that hardly ever changes while joints move; empty if there is none.

    Args:
        name: name of the channel.
        values: values of the channel (n, k).
        v: velocities (n, joints) [rad/s].
        rate: rate of the rows [Hz].
    """
    moving = np.flatnonzero((np.abs(v[1:]) > WARNINGS.moving_speed).any(axis=1)) + 1
    changes = sum(
        int((values[part] != values[part - 1]).any(axis=1).sum())
        for part in np.array_split(moving, 16)
    )
    if not 0 < changes < (1 - WARNINGS.max_held_share) * len(moving):
        return []
    return [
        f"The {name} changes only every {len(moving) / changes / rate:.2g} s while the arm moves: "
        "it is measured less often than it is written. Log at the rate at which it is measured."
    ]


def named_joints(joints: Iterable[int]) -> str:
    """Joints in a sentence, counted from 1: "joint 3" or "joints 1, 3"."""
    numbers = [str(j + 1) for j in joints]
    return f"{'joint' if len(numbers) == 1 else 'joints'} {', '.join(numbers)}"
