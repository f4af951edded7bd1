"""Reads a log of one arm from a CSV file, or a packed one, into SI units on a uniform grid."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.channels import channels_of
from joulepath.optimizer.identify.logs.columns import (
    Columns,
    Group,
    mapped,
    other_positions,
    recognised,
)
from joulepath.optimizer.identify.logs.effort import EffortReport, effort_report
from joulepath.optimizer.identify.logs.effort_checks import (
    check_signs,
    effort_warnings,
    joint_efforts,
)
from joulepath.optimizer.identify.logs.filters import noise
from joulepath.optimizer.identify.logs.grid import Grid, grid_of
from joulepath.optimizer.identify.logs.head import head_of
from joulepath.optimizer.identify.logs.joint_names import by_joint_name, in_order_of_joints
from joulepath.optimizer.identify.logs.lag import lag_of, power_lag_of
from joulepath.optimizer.identify.logs.log import EffortMeaning, Log
from joulepath.optimizer.identify.logs.log_report import LogReport
from joulepath.optimizer.identify.logs.log_warnings import (
    held_warning,
    log_warnings,
    numbers_of_joints,
)
from joulepath.optimizer.identify.logs.motion import Motion
from joulepath.optimizer.identify.logs.moves import cut, still_by_command, still_by_speed
from joulepath.optimizer.identify.logs.possible import (
    check_coarse,
    check_leaps,
    check_radians,
    check_sizes,
    joined_turns,
)
from joulepath.optimizer.identify.logs.rows import MOST_BYTES, Rows, Source
from joulepath.optimizer.identify.logs.speeds import speeds_of
from joulepath.optimizer.identify.logs.units import check_units, is_line_of_units, parted
from joulepath.optimizer.identify.logs.usable_effort import check_measured, usable
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.arrays import frozen

_OF_ANGLES: tuple[Group, ...] = ("q", "v", "a", "commanded")
_EFFORTS: tuple[Group, ...] = ("current", "torque", "effort")
_COMPARED = 20_000  # rows
_ROUGHER = 4.0  # times as much noise of positions at their times as row by row: the times are wrong
# channels that are differentiated twice, or compared, are kept in double precision; any other has
# fewer digits than single precision, which takes half of the memory
_PRECISE: tuple[Group, ...] = ("q", "payload")
_OF_ONE: tuple[Group, ...] = ("commanded", "power")
"""Groups of which one value of a row is kept."""


@dataclass(frozen=True)
class LogOptions:
    """What a file of a log does not say.

    `payload`: what the arm carried; None: what the log says, else nothing. `gravity` (3,) [m/s²] in
    the base frame. `columns` names the columns where their names are not known: see `mapped`.
    `units` are those of the joints, `current_units` those of currents. `effort` says what the
    efforts are; `auto` finds it out, and with None they are not read. `most_bytes` is the greatest
    size of the file after unpacking.
    """

    payload: Payload | None = None
    gravity: Sequence[float] | Array = (0.0, 0.0, -9.81)
    columns: Mapping[str, str | Sequence[str]] | None = None
    units: Literal["rad", "deg"] = "rad"
    current_units: Literal["A", "mA"] = "A"
    effort: EffortMeaning | Literal["auto"] | None = "auto"
    name: str | None = None
    tags: tuple[str, ...] = ()
    most_bytes: int = MOST_BYTES


@dataclass(frozen=True)
class LogReading:
    """A log, and what was seen while it was read."""

    log: Log
    report: LogReport


@dataclass
class _Channels:
    """Channels of a log, (rows, k) each, in SI units; taken out one by one, so that memory is freed
    early.
    """

    grid: Grid
    columns: Columns
    values: dict[Group, Array] = field(default_factory=dict)

    def take(self, group: Group) -> Array | None:
        """The channels on the grid."""
        values = self.values.pop(group, None)
        if values is None:
            return None
        return self.grid.resampled(
            values[self.grid.kept] if self.grid.repeated else values, group in ("q", "v")
        )


def check_header(source: Path | bytes, robot: Robot, options: LogOptions) -> None:
    """Raises InvalidTable unless the file begins as a log does: with names of columns that are
    known or mapped.
    """
    with Source(source, options.most_bytes) as file:
        _named(head_of(file, robot.joint_names).names, robot, options)


def read_log(
    source: str | PathLike[str] | bytes, robot: Robot, options: LogOptions | None = None
) -> LogReading:
    """Read a log of one arm from a CSV file into SI units on a uniform grid of time.

    Speeds and accelerations that the file does not have are derivatives of what it has, low-passed
    without delay. The columns that are known are listed in docs/identification.md.

    Args:
        source: path of the file, or its content. Either may be packed with gzip.
        robot: robot that the arm is one of.
        options: what the file does not say of itself; the defaults find out what they can.

    Returns:
        The log, and a report on its channels with warnings.

    Raises:
        InvalidTable: a row or the table as a whole is wrong; `row` and `column` say where.
        LogTooLarge: the file has more rows, or more bytes after unpacking, than are read.
        EffortNotUsable: the efforts exclude gravity, or it is not clear what they are.
        InvalidProblem: an option does not fit the file or the robot.
        OSError: the file cannot be read.
    """
    return _read(
        source if isinstance(source, bytes) else Path(source), robot, options or LogOptions()
    )


def _read(source: Path | bytes, robot: Robot, options: LogOptions) -> LogReading:
    gravity = frozen(options.gravity, (3,), "gravity")
    remarks: list[str] = []
    channels, dropped = _channels(source, robot, options, remarks)
    grid, columns = channels.grid, channels.columns
    rows = len(grid.kept)
    payload, payload_known = _payload(channels, options.payload)
    _trust_rows(channels, remarks)
    grid = channels.grid
    q = channels.take("q")
    assert q is not None
    logged = {
        group: channels.take(group) for group in ("v", "a", "commanded", "temperature", "wrench")
    }
    v, a = speeds_of(q, logged["v"], logged["a"], columns, grid.rate, remarks)
    motion = Motion(robot, payload, gravity, q, v, a, grid.rate)
    named = (
        None
        if options.effort is None
        else next((group for group in _EFFORTS if group in channels.values), None)
    )
    effort, found = None, None
    if named is not None:
        effort, found = _efforts(channels, named, motion, options, remarks)
    power = _power(channels, motion, remarks)
    still = (
        still_by_speed(v, grid.rate)
        if logged["commanded"] is None
        else still_by_command(logged["commanded"])
    )
    log = Log(
        robot=robot.name,
        time=grid.time,
        q=q,
        v=v,
        a=a,
        effort=effort,
        effort_meaning=None if found is None else found.meaning,
        power=power,
        temperature=logged["temperature"],
        wrench=logged["wrench"],
        payload=payload,
        payload_known=payload_known,
        gravity=gravity,
        rate=grid.rate,
        moves=cut(still, grid.rate, grid.gaps),
        name=options.name,
        tags=tuple(options.tags),
    )
    remarks += log_warnings(log, grid, columns)
    return LogReading(
        log,
        LogReport(
            rows, dropped, grid.jitter, channels_of(log, columns, named), found, tuple(remarks)
        ),
    )


def _efforts(
    channels: _Channels, named: Group, motion: Motion, options: LogOptions, remarks: list[str]
) -> tuple[Array, EffortReport]:
    """The efforts (n, joints) in the columns `named`, in time with the motion, and what they are.

    Raises EffortNotUsable."""
    effort = channels.take(named)
    assert effort is not None and options.effort is not None
    check_measured(effort)
    remarks += held_warning("effort", effort, motion.v, motion.rate)
    effort = _in_time("effort comes", effort, lag_of(motion, effort), channels.grid.time, remarks)
    said, judged = effort_report(motion, effort), joint_efforts(motion, effort)
    if said.meaning != "external" and options.effort != "external":
        check_signs(judged, [channels.columns.names[k] for k in channels.columns.groups[named]])
    found = usable(said, named, options.effort, remarks)
    remarks += effort_warnings(motion.robot, judged, effort, found.meaning)
    return effort, found


def _power(channels: _Channels, motion: Motion, remarks: list[str]) -> Array | None:
    """The power (n,), in time with the motion."""
    power = channels.take("power")
    if power is None:
        return None
    remarks += held_warning("power", power, motion.v, motion.rate)
    return _in_time(
        "power comes", power, power_lag_of(motion, power[:, 0]), channels.grid.time, remarks
    )[:, 0]


def _columns(
    names: Sequence[str], first: Sequence[str], robot: Robot, options: LogOptions
) -> Columns:
    """The columns that are read, by the header and the cells of the `first` row."""
    columns = _named(names, robot, options)
    return (
        columns
        if options.columns is not None
        else in_order_of_joints(columns, first, robot.joint_names)
    )


def _named(names: Sequence[str], robot: Robot, options: LogOptions) -> Columns:
    """The columns that are read, by the header. Raises InvalidTable or InvalidProblem."""
    if options.columns is not None:
        return mapped(names, options.columns, robot.nq)
    bare, _ = parted(names)
    return by_joint_name(bare, robot.joint_names) or recognised(bare, robot.nq)


def _begun(
    rows: Rows, robot: Robot, options: LogOptions, scales: Mapping[Group, float], remarks: list[str]
) -> Columns:
    """The columns that are read; `rows` are then those of numbers, with a line of units below the
    header left out.
    """
    names = rows.head.names
    first, row = rows.first()
    units = first if is_line_of_units(first) else []
    if units:
        rows.skip()
        remarks.append(f"Line {row} has no number, and is taken for units.")
        first, _ = rows.first()
    columns = _columns(names, first, robot, options)
    check_units(columns, parted(names)[1], row - 1, scales)
    check_units(columns, units, row, scales)
    other = None if options.columns is not None else other_positions(parted(names)[0], columns)
    if other is not None:
        remarks.append(
            "The header has positions of two kinds: those like "
            f"{columns.names[columns.groups['q'][0]]} are read, and "
            f"those like {other} are not. Name the columns in `columns` if that is wrong."
        )
    if len(first) < len(names):
        return columns
    columns, gone = columns.without(first)
    remarks += [
        f"The columns of {group} are empty in the first row, and are not read." for group in gone
    ]
    return columns


def _channels(
    source: Path | bytes, robot: Robot, options: LogOptions, remarks: list[str]
) -> tuple[_Channels, int]:
    """The channels of the file, in SI units, and the number of dropped lines."""
    scales: dict[Group, float] = dict.fromkeys(
        _OF_ANGLES, pi / 180 if options.units == "deg" else 1.0
    )
    scales["current"] = 1e-3 if options.current_units == "mA" else 1.0
    with Source(source, options.most_bytes) as file:
        rows = Rows(file, head_of(file, robot.joint_names), ())
        columns = _begun(rows, robot, options, scales, remarks)
        names = columns.names
        used = rows.used = columns.used
        where = {
            group: [used.index(k) for k in indices] for group, indices in columns.groups.items()
        }
        # arrays that grow in place: a log can fill half of the memory
        parts = {group: array("d" if group in _PRECISE else "f") for group in where}
        times, numbers = array("d"), array("i")
        for lines, block in rows.blocks():
            times.frombytes(_seconds(block[:, [used.index(k) for k in columns.time]]).tobytes())
            numbers.frombytes(lines.astype(np.int32).tobytes())
            check_sizes(block, lines, names, used, where, scales)
            for group, part in parts.items():
                values = _packed(group, block[:, where[group]] * scales.get(group, 1.0), part)
                part.frombytes(values.astype(part.typecode).tobytes())
            check_radians(
                block[:, where["q"]] * scales["q"],
                lines,
                robot,
                [names[k] for k in columns.groups["q"]],
            )
    grid = grid_of(np.frombuffer(times), np.frombuffer(numbers, np.int32), names[columns.time[0]])
    channels = {
        group: np.frombuffer(part, part.typecode).reshape(
            -1, 1 if group in _OF_ONE else len(where[group])
        )
        for group, part in parts.items()
    }
    _set_right(channels, grid, np.frombuffer(numbers, np.int32), robot, columns, remarks)
    return _Channels(grid, columns, channels), rows.dropped


def _set_right(
    channels: dict[Group, Array],
    grid: Grid,
    lines: Array,
    robot: Robot,
    columns: Columns,
    remarks: list[str],
) -> None:
    """Takes whole turns out of the positions. Raises InvalidTable for those that no arm has."""
    q, lines = channels["q"], lines[grid.kept] if grid.repeated else lines
    if grid.repeated:
        check_coarse(q, grid, columns.names[columns.time[0]])
    channels["q"], turned = joined_turns(q, robot)
    if turned:
        remarks.append(
            f"The positions of joints {numbers_of_joints(turned)} leap by whole turns, and are "
            "taken without the leaps."
        )
    q = channels["q"][grid.kept] if grid.repeated else channels["q"]
    check_leaps(q, grid, lines, robot, [columns.names[k] for k in columns.groups["q"]])


def _packed(group: Group, values: Array, before: array[float]) -> Array:
    """What is kept of the values (n, k) of a group behind those that are kept already: a log can
    fill half of the memory. Of commanded speeds the greatest one, of voltage and current their
    product, of the payload its changes."""
    if group == "commanded":
        return np.asarray(np.abs(values).max(axis=1))
    if group == "power":
        return np.asarray(values.prod(axis=1))
    if group == "payload":
        first = np.array(before[: values.shape[1]]) if before else values[0]
        return np.vstack([values[: not before], values[(values != first).any(axis=1)]])
    return values


def _seconds(stamps: Array) -> Array:
    """Times (n,) of one column (n, 1), or of seconds and nanoseconds (n, 2)."""
    return np.ascontiguousarray(stamps[:, 0]) if stamps.shape[1] == 1 else stamps @ [1.0, 1e-9]


def _trust_rows(channels: _Channels, remarks: list[str]) -> None:
    """Takes the rows as evenly spaced where the positions are far smoother so than at their
    times."""
    grid, q = channels.grid, channels.values["q"]
    if grid.uniform or grid.repeated or len(grid.gaps) or len(grid.kept) != len(grid.time):
        return
    # of the beginning: a log can fill half of the memory
    part = replace(grid, time=grid.time[:_COMPARED])
    by_row, by_time = (
        float(noise(x, grid.rate).sum()) for x in (q[:_COMPARED], part.resampled(q, True))
    )
    if by_time > _ROUGHER * by_row:
        channels.grid = replace(grid, uniform=True)
        remarks.append(
            "The times jitter, and the positions do not: they are times of writing, and the rows "
            "are taken as evenly "
            "spaced. Log the time of the controller."
        )


def _in_time(what: str, values: Array, lag: float, time: Array, remarks: list[str]) -> Array:
    """Channels (n, k) without their lag [s]; `what` says which."""
    if lag == 0:
        return values
    late = "later" if lag > 0 else "earlier"
    remarks.append(
        f"The {what} {1e3 * abs(lag):.0f} ms {late} than the motion that makes it, and is taken as "
        "so much "
        f"{'earlier' if lag > 0 else 'later'}: log both with the clock of the controller."
    )
    shifted = np.empty_like(values)
    for k, channel in enumerate(values.T):
        shifted[:, k] = np.interp(time + lag, time, channel)
    return shifted


def _payload(channels: _Channels, given: Payload | None) -> tuple[Payload, bool]:
    """What the arm carried, and whether anybody said so. Raises InvalidProblem for a mass that no
    body has.
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
    return Payload(mass, np.array(com or [0.0, 0.0, 0.0])), True
