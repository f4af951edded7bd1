"""The rows that fits see: logs averaged over short blocks of samples, with the moves that they
belong to.

An average over a block is a low-pass filter. It is the same for torques and for motion, so that it
adds no phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.link_regressor import (
    base_wrench_regressor,
    body_parameters,
    rigid_regressor,
    rigid_torques,
)
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.log import Log, LogMove
from joulepath.optimizer.identify.rows.same_motion import groups_of_motions

Numbers = npt.NDArray[np.int64]

# rate [Hz] of the rows: motions of arms and their torques are slower by far
RATE = 100.0
# of all logs together, and with regressors, of 3 kB each: residuals of neighbours are so alike that
# more tell no more
MOST_ROWS, MOST_REGRESSORS = 20_000, 8_000
# rad; a joint that stays within it over a move does not move
STILL = 1e-3
# rad/s; a slower joint that stands still has no speed but noise
SLOW = 0.02
# times the power at rest by the robot's own figures that no mean of a log reaches, nor the same
# part of it
FAR_POWER = 20.0
# a move longer than this [s] is cut into blocks, each of which counts as a move; the pause [s]
# between them is left out
LONGEST, BLOCK, PAUSE = 7.5, 5.0, 0.5


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows (n, nq) of all logs: q [rad], v [rad/s], a [rad/s²], `rigid` torques of links and load
    [N·m], and those of the `links` alone.

    `time` (n,) [s] is the middle of a row, from the start of its log. `effort` (n, nq) is the motor
    torque [N·m], or the motor current [A] if `current`; `power` (n,) [W] and `temperature` (n, nq)
    [°C]; all of them NaN where not logged. `log`, `move` (n,) are numbers from 0; moves count
    through all logs, and rows at rest belong to the move before. `group` (n,): moves along the same
    motion share one. `weight` (n,) [s] is the time that a row stands for, `regressor` (n, nq, 10
    nq) is that of the links, None where their inertials are taken as known. `wrench` (n, 6) [N,
    N·m] acts beneath the base, NaN where not logged. `wrench_regressor` (n, 6, 10 nq) is that of
    the links; with it, the wrench is without what the arm carries.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    rigid: Array
    links: Array
    effort: Array
    power: Array
    temperature: Array
    wrench: Array
    log: Numbers
    move: Numbers
    group: Numbers
    rest: Mask
    weight: Array
    current: bool
    regressor: Array | None = None
    wrench_regressor: Array | None = None

    def take(self, rows: Mask) -> Rows:
        """Only these rows (n,)."""
        parts = {
            name: value[rows]
            for name, value in self.__dict__.items()
            if isinstance(value, np.ndarray)
        }
        return Rows(**parts, current=self.current)

    @property
    def groups(self) -> Numbers:
        """Numbers of the groups in which something moves, in order."""
        return np.unique(self.group[~self.rest])


def rows_of(
    robot: Robot, logs: Sequence[Log], regressor: bool = False, wrench: bool = False
) -> Rows:
    """The rows of logs of one robot, with the regressors of its links or without.

    Raises InvalidProblem if a log is of another robot, has other joints, or a power that is none of
    the arm's bus."""
    if not logs:
        raise InvalidProblem("logs", "logs must name at least one log.")
    for log in logs:
        if log.robot != robot.name or log.joints != robot.nq:
            raise InvalidProblem(
                "logs", f"A log is of {log.robot} ({log.joints} joints), not of {robot.name}."
            )
        _check_power(robot, log)
    meanings = sorted({log.effort_meaning for log in logs if log.effort_meaning is not None})
    if len(meanings) > 1:
        raise InvalidProblem(
            "logs", f"The efforts of the logs must mean the same, not {' and '.join(meanings)}."
        )
    every = _stride(logs, MOST_REGRESSORS if regressor else MOST_ROWS)
    pieces, moves, number = [], 0, 0
    for number, log in enumerate(logs):
        checkpoint()
        piece, moves = _rows_of_log(robot, log, number, moves, every)
        if regressor:
            model = robot.model.copy()
            model.gravity.linear = log.gravity
            piece["regressor"] = rigid_regressor(model, piece["q"], piece["v"], piece["a"])
        if wrench:
            piece |= _wrench(robot, log, piece)
        pieces.append(piece)
    # taken out one by one, and not copied if there is nothing to join: regressors are large
    joined = {name: _joined([piece.pop(name) for piece in pieces]) for name in [*pieces[0]]}
    joined["group"] = groups_of_motions(joined["q"], joined["v"], joined["move"], joined["rest"])
    return Rows(**joined, current=meanings == ["current"])


def _wrench(robot: Robot, log: Log, rows: dict[str, Array]) -> dict[str, Array]:
    """The regressor of the wrench beneath the base, and the wrench without what the arm carries."""
    load = log.payload
    loaded = robot.loaded_model(load.mass, load.com, load.inertia, log.gravity)
    regressor = base_wrench_regressor(loaded, rows["q"], rows["v"], rows["a"])
    carried = body_parameters(loaded) - body_parameters(robot.model)
    return {"wrench_regressor": regressor, "wrench": rows["wrench"] - regressor @ carried}


def _check_power(robot: Robot, log: Log) -> None:
    expected = robot.electronics.idle_power + float(robot.drives.inverter_constant.sum())
    if log.power is None or expected <= 0 or not np.isfinite(log.power).any():
        return
    mean = float(np.nanmean(log.power, dtype=float))
    if not expected / FAR_POWER < mean < FAR_POWER * expected:
        raise InvalidProblem(
            "logs",
            f"The power of {'a log' if log.name is None else log.name} is {mean:.3g} W in the "
            f"mean, and {robot.name} "
            f"draws some {expected:.3g} W at rest: this is not the power of the arm's bus in W. "
            "Log it in W, with the "
            "sign that is positive where the arm draws power, or leave its column out.",
        )


def _joined(parts: list[Any]) -> Any:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _stride(logs: Sequence[Log], most: int) -> int:
    """Every how many rows of `RATE` one is taken, so that there are at most so many."""
    rows = sum(log.duration * min(log.rate, RATE) for log in logs)
    return max(1, int(np.ceil(rows / most)))


def _rows_of_log(
    robot: Robot, log: Log, number: int, moves: int, every: int
) -> tuple[dict[str, Array], int]:
    """The rows of one log by name, and the number of moves up to its end; `moves` is that of the
    logs before.
    """
    size = max(1, round(log.rate / RATE))
    starts, of_move, rest = _blocks(log, size, every)
    if not len(starts):
        raise InvalidProblem("logs", "A log has no move that is as long as a row.")

    def mean(channel: Array | None, shape: tuple[int, ...]) -> Array:
        if channel is None:
            return np.full((len(starts), *shape), np.nan)
        return np.asarray(np.mean([channel[starts + k] for k in range(size)], axis=0, dtype=float))

    joints = (robot.nq,)
    q, v, a = (mean(channel, joints) for channel in (log.q, log.v, log.a))
    # where the command rests, the arm may still come to rest
    still = _still(q, of_move, rest) & (np.abs(v) < SLOW)
    v[still], a[still] = 0.0, 0.0
    payload = log.payload
    model = robot.loaded_model(payload.mass, payload.com, payload.inertia, log.gravity)
    rigid = rigid_torques(model, q, v, a)
    links = rigid
    if payload.mass > 0:
        links = rigid_torques(
            robot.loaded_model(0.0, payload.com, payload.inertia * 0.0, log.gravity), q, v, a
        )
    return {
        "time": mean(log.time, ()),
        "q": q,
        "v": v,
        "a": a,
        "rigid": rigid,
        "links": links,
        "effort": mean(log.effort, joints),
        "power": mean(log.power, ()),
        "temperature": mean(log.temperature, joints),
        "wrench": mean(log.wrench, (6,)),
        "log": np.full(len(starts), number),
        "move": of_move + moves,
        "rest": rest,
        "weight": np.full(len(starts), size * every / log.rate),
    }, moves + int(of_move.max()) + 1


def _still(q: Array, move: Numbers, rest: Mask) -> Mask:
    """Where a joint stands still (n, nq): in rests, and in moves over which it stays in place. Its
    speed is noise.
    """
    still = np.repeat(rest[:, None], q.shape[1], axis=1)
    for number in np.unique(move):
        rows = np.flatnonzero((move == number) & ~rest)
        if rows.size:
            still[np.ix_(rows, np.flatnonzero(np.ptp(q[rows], axis=0) < STILL))] = True
    return still


def _blocks(log: Log, size: int, every: int) -> tuple[Numbers, Numbers, Mask]:
    """First samples of the blocks, the move of each from 0, and whether the arm rests there."""
    starts, of_move, rest = list[Numbers](), list[Numbers](), list[Mask]()
    number = 0
    for move in log.moves:
        for part in _parts(log, move):
            first = np.arange(part.start, part.end - size + 1, size * every)
            # the rest before the first move belongs to it, any other to the move before
            number += not part.at_rest
            starts.append(first)
            of_move.append(np.full(len(first), max(number - 1, 0)))
            rest.append(np.full(len(first), part.at_rest))
    if not starts:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0, dtype=bool)
    return np.concatenate(starts), np.concatenate(of_move), np.concatenate(rest)


def _parts(log: Log, move: LogMove) -> list[LogMove]:
    """The move, or the blocks of a long one."""
    if move.at_rest or move.end - move.start <= LONGEST * log.rate:
        return [move]
    length, pause = int(BLOCK * log.rate), int(PAUSE * log.rate)
    starts = range(move.start, move.end - length // 2, length + pause)
    return [LogMove(start, min(start + length, move.end), False) for start in starts]
