"""Columns to read, from the header, a line of units and the first row of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from joulepath.models.robot import Robot
from joulepath.optimizer.identify.logs.columns import (
    Columns,
    mapped,
    other_positions,
    recognised,
)
from joulepath.optimizer.identify.logs.file_rows import FileRows
from joulepath.optimizer.identify.logs.joint_names import by_joint_name, in_order_of_joints
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.units import check_units, is_line_of_units, split_units


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
