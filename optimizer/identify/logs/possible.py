"""Refusal of physically impossible numbers in a log, and removal of whole turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.grid import GRID, Grid
from joulepath.optimizer.identify.logs.log_formats import ChannelName

TWO_PI = 2 * np.pi


@dataclass(frozen=True)
class PlausibilitySettings:
    """Limits of plausible numbers."""

    max_angle: float = 20 * pi
    """Largest position: ten turns [rad]."""
    max_speed: float = MOTION_LIMITS.max_speed
    """Largest speed [rad/s]."""
    max_acceleration: float = MOTION_LIMITS.max_acceleration
    """Largest acceleration [rad/s²]."""
    max_number: float = 1e6
    """Largest number of any other channel [unit of the channel]."""
    max_step_speed: float = 3.0
    """Largest speed between two rows over the limit of the joint [1]."""
    max_mean_speed: float = 1.5
    """Largest speed over a time span over the limit of the joint [1]."""
    mean_span: float = 0.1
    """This time span [s]."""
    position_tolerance: float = 0.01
    """Change of a position due to the resolution of a coarse sensor [rad]."""
    max_coarse: float = 0.01
    """Largest share of rows with the time of the previous row, but other positions [1]."""


PLAUSIBLE = PlausibilitySettings()


def check_sizes(
    block: Array,
    lines: Array,
    names: Sequence[str],
    used: Sequence[int],
    where: Mapping[ChannelName, Sequence[int]],
    scales: Mapping[ChannelName, float],
) -> None:
    """Check a block of rows for numbers too large for a robot.

    Args:
        block: numbers (n, used columns).
        lines: lines of the rows in the file (n,).
        names: names of all columns.
        used: indices of the used columns.
        where: indices of the columns of each group in the block.
        scales: factor to SI units of each group.

    Raises:
        InvalidTable: a number is too large.
    """
    limits: Mapping[ChannelName, float] = {
        "v": PLAUSIBLE.max_speed,
        "commanded": PLAUSIBLE.max_speed,
        "a": PLAUSIBLE.max_acceleration,
    }
    for group, indices in where.items():
        size = np.abs(block[:, indices]) * scales.get(group, 1.0)
        wrong = np.argwhere(size > limits.get(group, PLAUSIBLE.max_number))
        if len(wrong):
            at, column = wrong[0].tolist()
            row, name = int(lines[at]), names[used[indices[column]]]
            raise InvalidTable(
                f"{name} in line {row} is too large for a robot: correct or delete it.",
                row,
                name,
            )


def check_radians(q: Array, rows: Array, robot: Robot, names: Sequence[str]) -> None:
    """Check that positions are not in degrees.

    Positions in degrees are far beyond the range of two joints, or many turns beyond the range of
    one; the last joint of some arms turns without end.

    Args:
        q: positions (n, joints) [rad].
        rows: lines of the rows in the file (n,).
        robot: the robot.
        names: names of the columns.

    Raises:
        InvalidTable: the positions look like degrees.
    """
    ratios = np.abs(q) / np.maximum(np.abs(robot.limits.q_min), np.abs(robot.limits.q_max))
    wrong = ((ratios > MOTION_LIMITS.max_position_ratio).sum(axis=1) > 1) | (
        np.abs(q) > PLAUSIBLE.max_angle
    ).any(axis=1)
    if wrong.any():
        at = int(np.argmax(wrong))
        row, name = int(rows[at]), names[int(ratios[at].argmax())]
        raise InvalidTable(
            f"{name} in line {row} is far beyond the joint's range and looks like degrees: give "
            "radians, or units=deg.",
            row,
            name,
        )


def without_whole_turns(q: Array, robot: Robot) -> tuple[Array, list[int]]:
    """Remove steps of whole turns, as of sensors that count from 0 to 360 degrees.

    Args:
        q: positions (m, joints) [rad].
        robot: the robot.

    Returns:
        The positions, and the joints with such steps.
    """
    joints = list[int]()
    for joint in range(q.shape[1]):
        turns = np.round(np.diff(q[:, joint]) / TWO_PI)
        if turns.any():
            if not joints:
                q = q.copy()
            joints.append(joint)
            q[1:, joint] -= TWO_PI * np.cumsum(turns)
            middle = 0.5 * (robot.limits.q_min[joint] + robot.limits.q_max[joint])
            q[:, joint] -= TWO_PI * np.round(
                (0.5 * (q[:, joint].min() + q[:, joint].max()) - middle) / TWO_PI
            )
    return q, joints


def check_leaps(q: Array, grid: Grid, lines: Array, robot: Robot, names: Sequence[str]) -> None:
    """Check that positions do not change faster than the arm can move.

    Args:
        q: positions (m, joints) of the rows of the grid [rad].
        grid: the grid.
        lines: lines of the rows in the file (m,).
        robot: the robot.
        names: names of the columns.

    Raises:
        InvalidTable: a position changes too fast.
    """
    span = max(1, round(PLAUSIBLE.mean_span * grid.rate))
    for rows, factor in ((1, PLAUSIBLE.max_step_speed), (span, PLAUSIBLE.max_mean_speed)):
        steps = np.maximum(grid.at[rows:] - grid.at[:-rows], rows / grid.rate)
        for joint, v_max in enumerate(robot.limits.v_max.tolist()):
            change = np.abs(q[rows:, joint] - q[:-rows, joint])
            wrong = change > factor * v_max * steps + PLAUSIBLE.position_tolerance
            if wrong.any():
                at = int(np.argmax(wrong))
                row, name = int(lines[at + rows]), names[joint]
                raise InvalidTable(
                    f"{name} changes by {change[at]:.3g} rad from line {lines[at]} to line "
                    f"{row}, within {steps[at]:.3g} s, but the joint reaches at most {v_max:.3g} "
                    "rad/s. Delete a wrong row; divide the log where rows were left out; give "
                    f"positions in rad (or units=deg), and times in seconds, {GRID.min_rate:g} "
                    "rows per second or more.",
                    row,
                    name,
                )


def check_coarse(q: Array, grid: Grid, column: str) -> None:
    """Check that rows with equal times have equal positions.

    Args:
        q: positions (n, joints) of all rows of the file [rad].
        grid: the grid.
        column: name of the column of times.

    Raises:
        InvalidTable: too many rows with equal times differ.
    """
    repeated = np.setdiff1d(np.arange(len(q)), grid.kept)
    coarse = 0
    if len(repeated):
        coarse = int((q[repeated] != q[repeated - 1]).any(axis=1).sum())
    if coarse > PLAUSIBLE.max_coarse * len(q):
        raise InvalidTable(
            f"{column} repeats in {coarse} of {len(q)} rows that differ: write times with more "
            "digits.",
            None,
            column,
        )
