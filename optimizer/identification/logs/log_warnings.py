"""What is odd in a log, in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from models.robot import Array, Mask
from optimizer.identification.logs.columns import Columns
from optimizer.identification.logs.filters import derivative, low_passed
from optimizer.identification.logs.grid import Grid
from optimizer.identification.logs.log import Log

_SATURATED, _LEAST_SATURATED = 0.005, 10
"""Fraction and number of moving rows at exactly the greatest effort beyond which it is cut off there."""
_MISFIT = 0.2
"""Greatest deviation of logged speeds from the change of the positions, over the speeds, as standard deviations."""
_LEAST_SPEED = 0.01  # rad/s, standard deviation from which on speeds are compared


def log_warnings(log: Log, grid: Grid, columns: Columns, speeds_logged: bool) -> list[str]:
    """Gaps, repeated times, constant or saturated channels, speeds that do not fit, what the log does not say."""
    found = [*_times(grid), *_constant(log), *_saturated(log)]
    if speeds_logged:
        found += _misfit(log)
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


def _misfit(log: Log) -> Iterator[str]:
    wrong = [j for j in range(log.joints) if _misfits(log.q[:, j], log.v[:, j], log.rate)]
    if wrong:
        yield (
            f"The speeds of joints {_numbers(wrong)} do not fit their positions: check units, signs and the order of "
            "the columns."
        )


def _misfits(q: Array, v: Array, rate: float) -> bool:
    smooth = low_passed(v[:, None], rate)
    size = smooth.std()
    return bool(size > _LEAST_SPEED and (smooth - derivative(q[:, None], rate)).std() > _MISFIT * size)


def _numbers(joints: Iterable[int]) -> str:
    return ", ".join(str(j + 1) for j in joints)
