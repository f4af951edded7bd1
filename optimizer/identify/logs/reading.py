"""Reads a log of one arm from a CSV file, or a packed one, into SI units on a uniform grid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.columns import EFFORTS, NOT_LOGGED, Columns
from joulepath.optimizer.identify.logs.effort import (
    EffortReport,
    choose_meaning,
    effort_report,
    unmeasured,
)
from joulepath.optimizer.identify.logs.effort_checks import (
    check_signs,
    effort_warnings,
    joint_efforts,
)
from joulepath.optimizer.identify.logs.file_channels import FileChannels, read_channels
from joulepath.optimizer.identify.logs.file_rows import LogSource
from joulepath.optimizer.identify.logs.filters import noise
from joulepath.optimizer.identify.logs.head import head_of
from joulepath.optimizer.identify.logs.header_columns import columns_of_header
from joulepath.optimizer.identify.logs.lag import effort_lag, power_lag
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.log_warnings import held_warning, log_warnings, named_joints
from joulepath.optimizer.identify.logs.motion import LoggedMotion
from joulepath.optimizer.identify.logs.moves import cut_into_moves, rests_by_command, rests_by_speed
from joulepath.optimizer.identify.logs.speeds import speeds_of
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.arrays import frozen
from joulepath.optimizer.problem.declared_types import check_type, checked_arguments


@dataclass(frozen=True)
class Channel:
    """A channel of a log."""

    name: str
    column: str | None
    """Column of the file; None for a channel computed from another one."""
    unit: str
    min: float
    max: float
    noise: float
    """Robust standard deviation of the part above the band of the filter."""


@dataclass(frozen=True)
class LogReport:
    """Findings of the reading of a log."""

    rows: int
    """Number of rows."""
    dropped: int
    """Number of lines dropped for their number of cells."""
    jitter: tuple[float, float]
    """5th and 95th percentile of the deviation of a time step [s]."""
    channels: tuple[Channel, ...]
    effort: EffortReport | None
    """Meaning of the efforts; None if no efforts were logged."""
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class LogReading:
    """A log, and the report on its reading."""

    log: Log
    report: LogReport


class _Efforts(NamedTuple):
    group: ChannelName
    values: Array
    report: EffortReport


def check_header(source: Path | bytes, robot: Robot, options: LogOptions) -> None:
    """Check that a file begins with a header of known or mapped columns.

    Raises:
        InvalidTable: the header is not known, or lacks a column.
        InvalidProblem: the map of columns is wrong.
    """
    with LogSource(source, options.max_bytes) as file:
        columns_of_header(head_of(file).names, robot, options)


@checked_arguments
def read_log(
    source: str | PathLike[str] | bytes, robot: Robot, options: LogOptions | None = None
) -> LogReading:
    """Read a log of one arm from a CSV file into SI units on a uniform grid of time.

    Speeds and accelerations that the file does not have are derivatives of its other channels,
    low-passed without delay. Known columns are listed in docs/reference/identification.md.

    Args:
        source: path of the file, or its content. Either may be packed with gzip.
        robot: robot of the log.
        options: information that the file does not contain; the defaults find out as much as
            possible.

    Returns:
        The log, and a report on its channels with warnings.

    Raises:
        InvalidTable: a row or the table as a whole is wrong; `row` and `column` locate the error.
        LogTooLarge: the file has too many rows, or too many bytes after unpacking.
        EffortNotUsable: the efforts exclude gravity, or their meaning is not clear.
        InvalidProblem: an option does not fit the file or the robot.
        OSError: the file cannot be read.
    """
    check_type("source", source, str, bytes, PathLike)
    path_or_content = source if isinstance(source, bytes) else Path(source)
    return _read(path_or_content, robot, options or LogOptions())


def _read(source: Path | bytes, robot: Robot, options: LogOptions) -> LogReading:
    gravity = robot.gravity if options.gravity is None else options.gravity
    gravity = frozen(gravity, (3,), "gravity")
    remarks: list[str] = []
    channels = read_channels(source, robot, options, remarks)
    grid, columns = channels.grid, channels.columns
    payload, payload_known = _payload(channels, options.payload, remarks)
    q = channels.take("q")
    assert q is not None
    logged = {
        group: channels.take(group) for group in ("v", "a", "commanded", "temperature", "wrench")
    }
    v, a = speeds_of(q, logged["v"], logged["a"], columns, grid.rate, remarks)
    motion = LoggedMotion(robot, payload, gravity, q, v, a, grid.rate)
    efforts = _efforts(channels, motion, options, remarks)
    power = _power(channels, motion, remarks)
    commanded = logged["commanded"]
    rests = rests_by_speed(v, grid.rate) if commanded is None else rests_by_command(commanded)
    log = Log(
        robot=robot.name,
        time=grid.time,
        q=q,
        v=v,
        a=a,
        effort=None if efforts is None else efforts.values,
        effort_meaning=None if efforts is None else efforts.report.meaning,
        torque_side="motor" if efforts is None else efforts.report.torque_side,
        power=power,
        temperature=logged["temperature"],
        wrench=logged["wrench"],
        payload=payload,
        payload_known=payload_known,
        gravity=gravity,
        rate=grid.rate,
        moves=cut_into_moves(rests, grid.rate, grid.gaps),
        name=options.name,
        tags=tuple(options.tags),
    )
    report = LogReport(
        rows=len(grid.kept),
        dropped=channels.dropped,
        jitter=grid.jitter,
        channels=tuple(_channels(log, columns, None if efforts is None else efforts.group)),
        effort=None if efforts is None else efforts.report,
        warnings=(*remarks, *log_warnings(log, grid, columns)),
    )
    return LogReading(log, report)


def _efforts(
    channels: FileChannels, motion: LoggedMotion, options: LogOptions, remarks: list[str]
) -> _Efforts | None:
    """Efforts (n, joints) without their lag, with their meaning; None if there are none.

    Raises:
        EffortNotUsable: the efforts exclude gravity, or their meaning is not clear.
    """
    if options.effort is None:
        return None
    group = next((each for each in EFFORTS if each in channels.values), None)
    if group is None:
        return None
    effort = channels.take(group)
    assert effort is not None
    not_logged = {j for j, k in enumerate(channels.columns.groups[group]) if k == NOT_LOGGED}
    missing = sorted(not_logged | unmeasured(effort, motion.v))
    if missing:
        effort = effort.copy()
        effort[:, missing] = 0.0
    remarks += held_warning("effort", effort, motion.v, motion.rate)
    lag = effort_lag(motion, effort)
    effort = _without_lag("effort comes", effort, lag, channels.grid.time, remarks)
    by_slope, regressions = effort_report(motion, effort), joint_efforts(motion, effort)
    if by_slope.meaning != "external" and options.effort != "external":
        names = [channels.columns.names[k] for k in channels.columns.groups[group]]
        check_signs(regressions, names)
    report = choose_meaning(by_slope, group, options.effort, remarks)
    if report.meaning == "torque":
        report = replace(report, torque_side=options.torque_side or motion.robot.torque_side)
    remarks += effort_warnings(motion.robot, regressions, effort, report.meaning)
    if missing:
        effort[:, missing] = np.nan
        remarks.append(
            f"The efforts of {named_joints(missing)} are not logged, or never change in motion: "
            "their figures are kept."
        )
    return _Efforts(group, effort, report)


def _power(channels: FileChannels, motion: LoggedMotion, remarks: list[str]) -> Array | None:
    """Power (n,) [W] without its lag; None if it was not logged."""
    power = channels.take("power")
    if power is None:
        return None
    remarks += held_warning("power", power, motion.v, motion.rate)
    lag = power_lag(motion, power[:, 0])
    return _without_lag("power comes", power, lag, channels.grid.time, remarks)[:, 0]


def _without_lag(what: str, values: Array, lag: float, time: Array, remarks: list[str]) -> Array:
    """Shift channels (n, k) by their lag.

    Args:
        what: subject and verb of the warning.
        values: the channels.
        lag: time by which they are late [s].
        time: times of the grid (n,) [s].
        remarks: list to receive the warning.
    """
    if lag == 0:
        return values
    late, opposite = ("later", "earlier") if lag > 0 else ("earlier", "later")
    remarks.append(
        f"The {what} {1e3 * abs(lag):.0f} ms {late} than the motion that makes it, and is taken as "
        f"so much {opposite}: log both with the clock of the controller."
    )
    shifted = np.empty_like(values)
    for k, channel in enumerate(values.T):
        shifted[:, k] = np.interp(time + lag, time, channel)
    return shifted


def _payload(
    channels: FileChannels, given: Payload | None, remarks: list[str]
) -> tuple[Payload, bool]:
    """Payload of the arm, and whether it is known; a missing centre of mass is remarked.

    Raises:
        InvalidProblem: the payload changes within the log, or has an impossible mass.
    """
    logged = channels.values.pop("payload", None)
    if given is not None:
        return given, True
    if logged is None:
        return Payload(), False
    if np.ptp(logged, axis=0).max() > 0:
        raise InvalidProblem(
            "payload", "The payload changes within the log: divide it there, or give `payload`."
        )
    mass, *com = logged[0].tolist()
    if mass > 0 and not com:
        remarks.append(
            f"The log has the mass of the payload, {mass:.4g} kg, without its centre of mass "
            "(payload_cog_0 to payload_cog_2), which is taken to be at the flange: log it, or give "
            "`payload`."
        )
    return Payload(mass, np.array(com or [0.0, 0.0, 0.0])), True


_UNITS = {"q": "rad", "v": "rad/s", "a": "rad/s²", "power": "W", "temperature": "°C"}
_EFFORT_UNITS = {"current": "A", "torque": "N·m", "external": "N·m"}


def _channels(log: Log, columns: Columns, effort: ChannelName | None) -> Iterator[Channel]:
    """All channels of a log.

    Args:
        log: the log.
        columns: columns of the file.
        effort: group of columns of the efforts.
    """
    units = _UNITS | {"effort": _EFFORT_UNITS.get(log.effort_meaning or "", ""), "wrench": "N"}
    sources: dict[str, ChannelName | None] = {
        "q": "q",
        "v": "v",
        "a": "a",
        "effort": effort,
        "temperature": "temperature",
        "wrench": "wrench",
    }
    for name, group in sources.items():
        values: Array | None = getattr(log, name)
        if values is None:
            continue
        indices = columns.groups.get(group) if group is not None else None
        for j, size in enumerate(noise(values, log.rate)):
            if np.isnan(values[0, j]):
                continue
            column = None if indices is None else columns.names[indices[j]]
            unit = "N·m" if name == "wrench" and j >= 3 else units[name]
            yield Channel(f"{name}{j + 1}", column, unit, *_range(values[:, j]), float(size))
    if log.power is not None:
        column = " · ".join(columns.names[k] for k in columns.groups["power"])
        (size,) = noise(log.power[:, None], log.rate)
        yield Channel("power", column, "W", *_range(log.power), float(size))


def _range(values: Array) -> tuple[float, float]:
    """Least and greatest value, with the digits of single precision."""
    low, high = (float(f"{each:.7g}") for each in (values.min(), values.max()))
    return low, high
