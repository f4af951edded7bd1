"""Columns to read, from the header, a line of units and the first row of a log, and checks of the
units that these name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from joulepath.models.robot import Robot
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import Columns, mapped, other_positions, recognised
from joulepath.optimizer.identify.logs.file_rows import FileRows
from joulepath.optimizer.identify.logs.head import is_number
from joulepath.optimizer.identify.logs.joint_names import by_joint_name, in_order_of_joints
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_options import LogOptions


def columns_of_header(names: Sequence[str], robot: Robot, options: LogOptions) -> Columns:
    """Columns by the header alone.

    Raises:
        InvalidTable: the header is not known, or lacks a column.
        InvalidProblem: the map of columns is wrong.
    """
    if options.columns is not None:
        return mapped(names, options.columns, robot.nq)
    bare, _ = split_units(names)
    return by_joint_name(bare, robot.joint_names) or recognised(bare, robot.nq)


def columns_of_rows(
    rows: FileRows,
    robot: Robot,
    options: LogOptions,
    scales: Mapping[ChannelName, float],
    remarks: list[str],
) -> Columns:
    """Columns by the header and the first row; a line of units below the header is skipped.

    Args:
        rows: rows of the file, none of which has been read.
        robot: the robot of the log.
        options: options of the reading.
        scales: factor to SI units of each channel.
        remarks: list to receive warnings.

    Raises:
        InvalidTable: the header is not known, lacks a column, or names other units.
        InvalidProblem: the map of columns is wrong.
    """
    names = rows.head.names
    first, row = rows.first()
    units = first if is_line_of_units(first) else []
    if units:
        rows.skip()
        remarks.append(f"Line {row} has no number, and is taken for units.")
        first, _ = rows.first()
    columns = columns_of_header(names, robot, options)
    bare, header_units = split_units(names)
    if options.columns is None:
        columns = in_order_of_joints(columns, first, robot.joint_names)
    check_units(columns, header_units, row - 1, scales)
    check_units(columns, units, row, scales)
    other = None if options.columns is not None else other_positions(bare, columns)
    if other is not None:
        remarks.append(
            "The header has positions of two kinds: those like "
            f"{columns.names[columns.groups['q'][0]]} are read, and those like {other} are not. "
            "Name the columns in `columns` if that is wrong."
        )
    if len(first) < len(names):
        return columns
    columns, removed = columns.without_empty(first)
    remarks += [
        f"The columns of {group} are empty in the first row, and are not read." for group in removed
    ]
    return columns


_DIGITS = frozenset("0123456789")
_NUMBER_START = re.compile(r"[-+]?[.,]?[0-9]")


def _unit(pattern: str) -> re.Pattern[str]:
    return re.compile(rf"\W*(?:{pattern})\W*", re.IGNORECASE)


@dataclass(frozen=True)
class _UnitCheck:
    """Units of some groups of columns."""

    groups: tuple[ChannelName, ...]
    other: re.Pattern[str]
    """Units other than the SI unit."""
    si: re.Pattern[str]
    """The SI unit."""
    other_remedy: str
    """Option for columns in another unit."""
    si_remedy: str
    """Option for columns in the SI unit."""


_DEGREES = _unit(r"(?:deg|degrees?|°|º)(?:\W.*|s|s\^?2)?")
_RADIANS = _unit(r"(?:rad|radians?)(?:\W.*|s|s\^?2)?")
_UNIT_CHECKS = (
    _UnitCheck(("q", "v", "a", "commanded"), _DEGREES, _RADIANS, "units=deg", "units=rad"),
    _UnitCheck(
        ("current",),
        _unit(r"ma|milliamp\w*"),
        _unit(r"a|amps?|amperes?"),
        "current_units=mA",
        "current_units=A",
    ),
    _UnitCheck(("power",), _unit("[km]w"), _unit("w"), "W", "W"),
    _UnitCheck(("torque", "effort"), _unit(r"[km]n\W?m|n\W?mm"), _unit(r"n\W?m"), "N·m", "N·m"),
)


def split_units(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of columns without units in brackets, and the units; empty for a name without unit."""
    parts = [_split_unit(name) for name in names]
    return [bare for bare, _ in parts], [unit for _, unit in parts]


def _split_unit(name: str) -> tuple[str, str]:
    """Split a name from the unit in brackets behind it.

    A number in brackets is the number of a joint and remains in the name.

    Returns:
        Name and unit; the unit is empty if there is none.
    """
    begin = max(name.rfind("["), name.rfind("("))
    bare, unit = name[: max(begin, 0)].rstrip(), name[begin + 1 : -1]
    is_unit = bare and name.endswith((")", "]")) and not {*unit} & {*")]"}
    if is_unit and any(each not in _DIGITS and not each.isspace() for each in unit):
        return bare, unit
    return name, ""


def is_line_of_units(cells: Sequence[str]) -> bool:
    """Whether a line below the header contains words only."""
    texts = [cell.strip().strip("\"'").lower() for cell in cells]
    words = any(cell not in ("", "nan", "none", "null") for cell in texts)
    return words and not any(_NUMBER_START.match(cell) or is_number(cell) for cell in texts)


def check_units(
    columns: Columns, units: Sequence[str], row: int, scales: Mapping[ChannelName, float]
) -> None:
    """Check the named units of the columns against the expected units.

    Args:
        columns: columns of the file.
        units: unit of each column, or empty.
        row: number of the line with the units.
        scales: factor from the unit of each group to its SI unit; 1 for SI units.

    Raises:
        InvalidTable: a column has another unit.
    """
    for check in _UNIT_CHECKS:
        for group in check.groups:
            is_si = scales.get(group, 1.0) == 1.0
            wrong, remedy = (
                (check.other, check.other_remedy) if is_si else (check.si, check.si_remedy)
            )
            for k in columns.groups.get(group, ()):
                if 0 <= k < len(units) and wrong.fullmatch(units[k].strip()):
                    name = columns.names[k]
                    raise InvalidTable(
                        f"{name} has another unit in line {row} than the one it is read in: give "
                        f"{remedy}.",
                        row,
                        name,
                    )
