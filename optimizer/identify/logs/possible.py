"""What no arm has: too large numbers, degrees, leaps and coarse times, which are refused; whole
turns, which are taken out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.evaluate.recording import FAR_OUT, MOST_ACCELERATION, MOST_SPEED
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.columns import Group
from joulepath.optimizer.identify.logs.grid import LEAST_RATE, Grid

_MOST_ANGLE = 20 * pi  # rad, ten turns
_MOST: Mapping[Group, float] = {"v": MOST_SPEED, "commanded": MOST_SPEED, "a": MOST_ACCELERATION}
_MOST_OF_OTHERS = 1e6  # any unit
_FASTER, _FAST, _SPAN = 3.0, 1.5, 0.1
"""Times the greatest speed of a joint that no two rows are apart, and no rows that are so far apart
[s].
"""
_SLACK = 0.01  # rad, of coarse sensors
_TURN = 2 * np.pi
_MOST_COARSE = 0.01  # fraction of rows with the time of the row before, but other positions


def check_sizes(
    block: Array,
    lines: Array,
    names: Sequence[str],
    used: Sequence[int],
    where: Mapping[Group, Sequence[int]],
    scales: Mapping[Group, float],
) -> None:
    """Raises InvalidTable for a number that no arm has: it would spoil everything that is
    computed."""
    for group, indices in where.items():
        wrong = np.argwhere(
            np.abs(block[:, indices]) * scales.get(group, 1.0) > _MOST.get(group, _MOST_OF_OTHERS)
        )
        if len(wrong):
            at, column = wrong[0].tolist()
            row, name = int(lines[at]), names[used[indices[column]]]
            raise InvalidTable(
                f"{name} in line {row} is too large to be a robot's: correct or delete it.",
                row,
                name,
            )


def check_radians(q: Array, rows: Array, robot: Robot, names: Sequence[str]) -> None:
    """Raises InvalidTable if q (n, joints), in lines `rows` (n,), is rather in degrees: far beyond
    the range of two joints, or by many turns beyond that of one, as the last joint of some arms
    turns without end."""
    ratios = np.abs(q) / np.maximum(np.abs(robot.limits.q_min), np.abs(robot.limits.q_max))
    wrong = ((ratios > FAR_OUT).sum(axis=1) > 1) | (np.abs(q) > _MOST_ANGLE).any(axis=1)
    if wrong.any():
        at = int(np.argmax(wrong))
        row, name = int(rows[at]), names[int(ratios[at].argmax())]
        raise InvalidTable(
            f"{name} in line {row} is far beyond the joint's range and looks like degrees: give "
            "radians, or units=deg.",
            row,
            name,
        )


def joined_turns(q: Array, robot: Robot) -> tuple[Array, list[int]]:
    """Positions q (m, joints) [rad] without leaps by whole turns, as of sensors that count from 0
    to 360 degrees, and the joints that had some."""
    found = list[int]()
    for joint in range(q.shape[1]):
        turns = np.round(np.diff(q[:, joint]) / _TURN)
        if turns.any():
            if not found:
                q = q.copy()
            found.append(joint)
            q[1:, joint] -= _TURN * np.cumsum(turns)
            middle = 0.5 * (robot.limits.q_min[joint] + robot.limits.q_max[joint])
            q[:, joint] -= _TURN * np.round(
                (0.5 * (q[:, joint].min() + q[:, joint].max()) - middle) / _TURN
            )
    return q, found


def check_leaps(q: Array, grid: Grid, lines: Array, robot: Robot, names: Sequence[str]) -> None:
    """Raises InvalidTable where positions q (m, joints) [rad] of the grid's rows, which are in
    these lines (m,) of the file, change faster than the arm can."""
    span = max(1, round(_SPAN * grid.rate))
    for rows, factor in ((1, _FASTER), (span, _FAST)):
        steps = np.maximum(grid.at[rows:] - grid.at[:-rows], rows / grid.rate)
        for joint, most in enumerate(robot.limits.v_max.tolist()):
            change = np.abs(q[rows:, joint] - q[:-rows, joint])
            wrong = change > factor * most * steps + _SLACK
            if wrong.any():
                at = int(np.argmax(wrong))
                row, name = int(lines[at + rows]), names[joint]
                raise InvalidTable(
                    f"{name} changes by {change[at]:.3g} rad from line {lines[at]} to line {row}, "
                    "within "
                    f"{steps[at]:.3g} s, and the joint does at most {most:.3g} rad/s. Delete a "
                    "wrong row; divide the "
                    "log where rows were left out; give positions in rad (or units=deg), and times "
                    "in seconds, "
                    f"{LEAST_RATE:g} rows per second or more.",
                    row,
                    name,
                )


def check_coarse(q: Array, grid: Grid, column: str) -> None:
    """Raises InvalidTable if rows of q (n, joints), all that were read, differ and have the same
    time.
    """
    again = np.setdiff1d(np.arange(len(q)), grid.kept)
    coarse = int((q[again] != q[again - 1]).any(axis=1).sum()) if len(again) else 0
    if coarse > _MOST_COARSE * len(q):
        raise InvalidTable(
            f"{column} repeats itself in {coarse} of {len(q)} rows that differ: write times with "
            "more digits.",
            None,
            column,
        )
