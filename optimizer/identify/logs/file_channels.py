"""Channels of the file of a log in SI units, with checks of their numbers and times."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.logs.columns import NOT_LOGGED, Columns
from joulepath.optimizer.identify.logs.file_rows import FileRows, LogSource
from joulepath.optimizer.identify.logs.filters import noise
from joulepath.optimizer.identify.logs.grid import Grid, grid_of
from joulepath.optimizer.identify.logs.head import head_of
from joulepath.optimizer.identify.logs.header_columns import columns_of_rows
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.log_warnings import named_joints
from joulepath.optimizer.identify.logs.possible import (
    TWO_PI,
    check_coarse,
    check_leaps,
    check_radians,
    check_sizes,
    without_whole_turns,
)

_ANGULAR: tuple[ChannelName, ...] = ("q", "v", "a", "commanded")
_DOUBLE_PRECISION: tuple[ChannelName, ...] = ("q", "payload")
"""Channels that are differentiated twice, or compared. All others have fewer digits than single
precision, which takes half of the memory."""
_ONE_VALUE: tuple[ChannelName, ...] = ("commanded", "power")
"""Channels with one value per row."""


@dataclass(frozen=True)
class JitterSettings:
    """Settings of the test for jitter of the times."""

    rows: int = 20_000
    """Largest number of compared rows."""
    noise_ratio: float = 4.0
    """Noise of the positions at the logged times over that at even times, above which the times
    are wrong [1]."""


JITTER = JitterSettings()


@dataclass(frozen=True)
class FileChannels:
    """Channels of a file in SI units.

    `take` removes a channel, so that its memory is freed early.
    """

    grid: Grid
    columns: Columns
    dropped: int
    """Number of dropped lines."""
    values: dict[ChannelName, Array]
    """Values (rows, k) of each channel."""

    def take(self, group: ChannelName) -> Array | None:
        """Remove a channel and resample it to the grid; None if it was not logged."""
        values = self.values.pop(group, None)
        if values is None:
            return None
        grid = self.grid
        return grid.resampled(values[grid.kept] if grid.repeated else values, group in ("q", "v"))


def read_channels(
    source: Path | bytes, robot: Robot, options: LogOptions, remarks: list[str]
) -> FileChannels:
    """Read the channels of a file.

    Args:
        source: path of the file, or its content.
        robot: the robot of the log.
        options: options of the reading.
        remarks: list to receive warnings.

    Raises:
        InvalidTable: a row or the table as a whole is wrong.
        LogTooLarge: the file is too large.
        InvalidProblem: an option does not fit the file or the robot.
    """
    scales: dict[ChannelName, float] = dict.fromkeys(
        _ANGULAR, pi / 180 if options.units == "deg" else 1.0
    )
    scales["current"] = 1e-3 if options.current_units == "mA" else 1.0
    with LogSource(source, options.max_bytes) as file:
        rows = FileRows(file, head_of(file))
        columns = columns_of_rows(rows, robot, options, scales, remarks)
        times, lines, values = _read_rows(rows, columns, robot, scales)
    _check_degrees(values["q"], options, remarks)
    grid = grid_of(times, lines, columns.names[columns.time[0]])
    _check_positions(values, grid, lines, robot, columns, remarks)
    return FileChannels(
        _even_if_jittering(grid, values["q"], remarks), columns, rows.dropped, values
    )


def _read_rows(
    rows: FileRows, columns: Columns, robot: Robot, scales: Mapping[ChannelName, float]
) -> tuple[Array, Array, dict[ChannelName, Array]]:
    """Times (n,), numbers of the lines (n,), and values (n, k) of each channel in SI units."""
    names, used = columns.names, columns.used
    # of an effort that was not logged, any column: its numbers are not read
    where = {
        group: [-1 if k == NOT_LOGGED else used.index(k) for k in indices]
        for group, indices in columns.groups.items()
    }
    # arrays that grow in place, because a log can fill half of the memory
    parts = {group: array("d" if group in _DOUBLE_PRECISION else "f") for group in where}
    times, numbers = array("d"), array("i")
    positions = [names[k] for k in columns.groups["q"]]
    for lines, block in rows.blocks(used):
        times.frombytes(_seconds(block[:, [used.index(k) for k in columns.time]]).tobytes())
        numbers.frombytes(lines.astype(np.int32).tobytes())
        check_sizes(block, lines, names, used, where, scales)
        for group, part in parts.items():
            values = _reduced(group, block[:, where[group]] * scales.get(group, 1.0), part)
            missing = [k for k, at in enumerate(columns.groups[group]) if at == NOT_LOGGED]
            if missing:
                values[:, missing] = 0.0
            part.frombytes(values.astype(part.typecode).tobytes())
        check_radians(block[:, where["q"]] * scales["q"], lines, robot, positions)
    channels = {
        group: np.frombuffer(part, part.typecode).reshape(
            -1, 1 if group in _ONE_VALUE else len(where[group])
        )
        for group, part in parts.items()
    }
    return np.frombuffer(times), np.frombuffer(numbers, np.int32), channels


def _check_positions(
    channels: dict[ChannelName, Array],
    grid: Grid,
    lines: Array,
    robot: Robot,
    columns: Columns,
    remarks: list[str],
) -> None:
    """Remove whole turns from the positions.

    Raises:
        InvalidTable: positions are impossible for the arm.
    """
    q = channels["q"]
    if grid.repeated:
        lines = lines[grid.kept]
        check_coarse(q, grid, columns.names[columns.time[0]])
    channels["q"], turned = without_whole_turns(q, robot)
    if turned:
        remarks.append(
            f"The positions of {named_joints(turned)} jump by whole turns; the jumps are removed."
        )
    q = channels["q"][grid.kept] if grid.repeated else channels["q"]
    check_leaps(q, grid, lines, robot, [columns.names[k] for k in columns.groups["q"]])


def _check_degrees(q: Array, options: LogOptions, remarks: list[str]) -> None:
    """Remark on positions (n, joints) [rad] so small that they were not given in degrees."""
    if options.units == "deg" and np.abs(q).max() <= TWO_PI * pi / 180 and np.ptp(q, axis=0).any():
        remarks.append(
            "No position exceeds 6.3 degrees. If the positions are in radians, leave out units=deg."
        )


def _reduced(group: ChannelName, values: Array, before: array[float]) -> Array:
    """The part of a block of values (n, k) to keep, because a log can fill half of the memory.

    Kept are the largest commanded speed, the product of voltage and current, and changes of the
    payload.

    Args:
        group: channel of the values.
        values: the values.
        before: values kept from earlier blocks.
    """
    if group == "commanded":
        return np.asarray(np.abs(values).max(axis=1))
    if group == "power":
        return np.asarray(values.prod(axis=1))
    if group == "payload":
        first = np.array(before[: values.shape[1]]) if before else values[0]
        return np.vstack([values[: not before], values[(values != first).any(axis=1)]])
    return values


def _seconds(stamps: Array) -> Array:
    """Times (n,) [s] of one column (n, 1), or of seconds and nanoseconds (n, 2)."""
    return np.ascontiguousarray(stamps[:, 0]) if stamps.shape[1] == 1 else stamps @ [1.0, 1e-9]


def _even_if_jittering(grid: Grid, q: Array, remarks: list[str]) -> Grid:
    """The grid, with even times if the positions (n, joints) are far smoother at even times."""
    if grid.uniform or grid.repeated or len(grid.gaps) or len(grid.kept) != len(grid.time):
        return grid
    beginning = replace(grid, time=grid.time[: JITTER.rows])
    by_row, by_time = (
        float(noise(x, grid.rate).sum()) for x in (q[: JITTER.rows], beginning.resampled(q, True))
    )
    if by_time <= JITTER.noise_ratio * by_row:
        return grid
    remarks.append(
        "The times jitter, but the positions do not: these are times of writing, so the rows "
        "are taken as evenly spaced. Log the time of the controller."
    )
    return replace(grid, uniform=True)
