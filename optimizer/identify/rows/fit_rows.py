"""Rows for the fits: logs averaged over short blocks of samples, with their moves.

An average over a block is a low-pass filter. It is the same for torques and for motion, so it adds
no phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.models.robot import Array, Mask, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.link_regressor import (
    base_wrench_regressor,
    body_parameters,
    rigid_regressor,
    rigid_torques,
)
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.estimates.grouped import IntArray
from joulepath.optimizer.identify.logs.log import Log, LogMove
from joulepath.optimizer.identify.rows.same_motion import groups_of_motions


@dataclass(frozen=True)
class RowSettings:
    """Settings of the averaging of logs into rows."""

    rate: float = 100.0
    """Rate of the rows [Hz]; motions of arms and their torques are slower by far."""
    max_rows: int = 20_000
    """Largest number of rows of all logs; neighbouring residuals are so correlated that more rows
    carry no more information."""
    max_regressor_rows: int = 8_000
    """Largest number of rows with regressors, of 3 kB each."""
    still_range: float = 1e-3
    """Range of a joint over a move up to which the joint stands still [rad]."""
    still_speed: float = 0.02
    """Speed of a joint that stands still, up to which the speed is noise [rad/s]."""
    reversals: tuple[float, ...] = (1e-5, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
    """Distances over which the friction of bearings behind torque sensors may reverse [rad]; 1e-3
    and 2e-3 are the best ones of two Pandas."""
    max_power_ratio: float = 20.0
    """Ratio of the mean power of a log to the robot's own power at rest, or of the latter to the
    former, from which on the channel is not the power of the bus [1]."""
    max_move_duration: float = 7.5
    """Duration above which a move is cut into blocks; each block then counts as a move [s]."""
    block_duration: float = 5.0
    """Duration of a block [s]."""
    block_gap: float = 0.5
    """Time left out between two blocks [s]."""


ROWS = RowSettings()


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of all logs, n in number; a channel is NaN where it was not logged."""

    time: Array
    """Middle of a row (n,), from the start of its log [s]."""
    q: Array
    """Positions (n, nq) [rad]."""
    v: Array
    """Velocities (n, nq) [rad/s]."""
    a: Array
    """Accelerations (n, nq) [rad/s²]."""
    rigid: Array
    """Rigid-body torques (n, nq) of links and load [N·m]."""
    link_torques: Array
    """Rigid-body torques (n, nq) of the links alone [N·m]."""
    effort: Array
    """Torques (n, nq) [N·m], of the links if `link_side` and otherwise of the motors; or motor
    currents [A] if `current`."""
    power: Array
    """Power on the arm's bus (n,) [W]."""
    temperature: Array
    """Temperatures of the joints (n, nq) [°C]."""
    wrench: Array
    """Force and torque (n, 6) beneath the base [N, N·m]; without the part of the load if there is
    a `wrench_regressor`."""
    log: IntArray
    """Number of the log (n,), from 0."""
    move: IntArray
    """Number of the move (n,), from 0 through all logs; rows at rest belong to the previous
    move."""
    group: IntArray
    """Number of the motion (n,); moves along the same motion share it."""
    cycle: IntArray
    """Number of the cycle (n,), different in every log; -1 outside of the cycles of a log."""
    rest: Mask
    """Whether the arm rests (n,)."""
    weight: Array
    """Time that a row stands for (n,) [s]."""
    current: bool
    """Whether `effort` is a current."""
    link_side: bool = False
    """Whether `effort` was measured behind the gears, without rotors and the motors' friction."""
    drags: Array | None = None
    """Direction (n, nq, d) of the friction behind the gears, from -1 to 1, for d distances over
    which it may reverse; None for efforts of the motors."""
    regressor: Array | None = None
    """Regressor (n, nq, 10 nq) of the links' torques; None where the inertials count as known."""
    wrench_regressor: Array | None = None
    """Regressor (n, 6, 10 nq) of the links' wrench beneath the base."""

    def take(self, rows: Mask) -> Rows:
        """The chosen rows (n,) only."""
        parts = {
            name: value[rows]
            for name, value in self.__dict__.items()
            if isinstance(value, np.ndarray)
        }
        return Rows(**parts, current=self.current, link_side=self.link_side)

    @property
    def groups(self) -> IntArray:
        """Sorted numbers of the motions."""
        return np.unique(self.group[~self.rest])


def rows_of(
    robot: Robot, logs: Sequence[Log], regressor: bool = False, wrench: bool = False
) -> Rows:
    """Average logs of one robot into rows.

    Args:
        robot: the robot of all logs.
        logs: at least one log.
        regressor: whether to compute the regressors of the links' torques.
        wrench: whether to compute the regressors of the wrench beneath the base.

    Raises:
        InvalidProblem: a log is of another robot, has another number of joints, or its power is
            not the power of the arm's bus.
    """
    if not logs:
        raise InvalidProblem("logs", "logs must name at least one log.")
    for log in logs:
        if log.robot != robot.name or log.joints != robot.nq:
            raise InvalidProblem(
                "logs", f"A log belongs to {log.robot} ({log.joints} joints), not to {robot.name}."
            )
        _check_power(robot, log)
    meanings = sorted({str(log.effort_meaning) for log in logs if log.carries_weight})
    if len(meanings) > 1:
        raise InvalidProblem(
            "logs", f"The efforts of the logs must mean the same, not {' and '.join(meanings)}."
        )
    sides = sorted({log.torque_side for log in logs if log.effort_meaning == "torque"})
    if len(sides) > 1:
        raise InvalidProblem(
            "logs",
            "The torques of the logs must be of the same side of the gears, not of motors and "
            "links: identify from each side separately.",
        )
    stride = _stride(logs, ROWS.max_regressor_rows if regressor else ROWS.max_rows)
    pieces, moves, number = [], 0, 0
    for number, log in enumerate(logs):
        checkpoint()
        piece, moves = _rows_of_log(robot, log, number, moves, stride)
        if regressor:
            model = robot.model.copy()
            model.gravity.linear = log.gravity
            piece["regressor"] = rigid_regressor(model, piece["q"], piece["v"], piece["a"])
        if wrench:
            piece |= _wrench(robot, log, piece)
        pieces.append(piece)
    # popped one by one, and not copied if there is one piece only: regressors are large
    joined = {name: _joined([piece.pop(name) for piece in pieces]) for name in [*pieces[0]]}
    joined["group"] = groups_of_motions(joined["q"], joined["v"], joined["move"], joined["rest"])
    link_side = sides == ["link"]
    drags = _drags(joined["q"], joined["v"], joined["log"]) if link_side else None
    return Rows(**joined, current=meanings == ["current"], link_side=link_side, drags=drags)


def _drags(q: Array, v: Array, log: IntArray) -> Array:
    """Direction (n, nq, d) of the friction of bearings, which reverses over a distance and not over
    a speed (Dahl 1976).

    Args:
        q: positions (n, nq) [rad].
        v: velocities (n, nq) [rad/s], whose direction counts where a log begins.
        log: number of the log (n,).
    """
    step = np.diff(q, axis=0, prepend=q[:1])[:, :, None]
    forward, kept = np.sign(step), np.exp(-np.abs(step) / np.array(ROWS.reversals))
    first = np.flatnonzero(np.diff(log, prepend=-1))
    forward[first], kept[first] = np.sign(v[first])[:, :, None], 0.0
    drags: Array = np.empty_like(kept)
    state: Array = np.zeros(kept.shape[1:])
    for row in range(len(q)):
        state = forward[row] + (state - forward[row]) * kept[row]
        drags[row] = state
    return drags


def _wrench(robot: Robot, log: Log, rows: dict[str, Array]) -> dict[str, Array]:
    """Regressor of the wrench beneath the base, and the wrench without the part of the load."""
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
    if not expected / ROWS.max_power_ratio < mean < ROWS.max_power_ratio * expected:
        raise InvalidProblem(
            "logs",
            f"The power of {'a log' if log.name is None else log.name} is {mean:.3g} W on "
            f"average, and {robot.name} draws some {expected:.3g} W at rest: this is not the "
            "power of the arm's bus in W. Log it in W, with the sign that is positive where the "
            "arm draws power, or leave its column out.",
        )


def _joined(parts: list[Any]) -> Any:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _stride(logs: Sequence[Log], max_rows: int) -> int:
    """Smallest k such that every k-th row of all logs makes at most `max_rows` rows."""
    rows = sum(log.duration * min(log.rate, ROWS.rate) for log in logs)
    return max(1, int(np.ceil(rows / max_rows)))


def _rows_of_log(
    robot: Robot, log: Log, number: int, moves: int, stride: int
) -> tuple[dict[str, Array], int]:
    """Channels of the rows of one log.

    Args:
        robot: the robot.
        log: the log.
        number: number of the log.
        moves: number of moves of all previous logs.
        stride: every how many rows one is kept.

    Returns:
        The channels by name, and the number of moves including those of this log.
    """
    size = max(1, round(log.rate / ROWS.rate))
    starts, of_move, rest = _blocks(log, size, stride)
    if not len(starts):
        raise InvalidProblem("logs", "A log has no move as long as a row.")

    def mean(channel: Array | None, shape: tuple[int, ...]) -> Array:
        if channel is None:
            return np.full((len(starts), *shape), np.nan)
        return np.asarray(np.mean([channel[starts + k] for k in range(size)], axis=0, dtype=float))

    joints = (robot.nq,)
    q, v, a = (mean(channel, joints) for channel in (log.q, log.v, log.a))
    # the arm may still settle after its command has come to rest
    still = _standing_joints(q, of_move, rest) & (np.abs(v) < ROWS.still_speed)
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
        "link_torques": links,
        "effort": mean(log.effort if log.carries_weight else None, joints),
        "power": mean(log.power, ()),
        "temperature": mean(log.temperature, joints),
        "wrench": mean(log.wrench, (6,)),
        "log": np.full(len(starts), number),
        "move": of_move + moves,
        "cycle": _cycles(log, number, starts),
        "rest": rest,
        "weight": np.full(len(starts), size * stride / log.rate),
    }, moves + int(of_move.max()) + 1


def _cycles(log: Log, number: int, starts: IntArray) -> IntArray:
    """Number of the cycle of each row (n,), by its first sample; -1 outside of the cycles."""
    edges = log.cycle_rows
    cycle = np.searchsorted(edges, starts, side="right") - 1
    outside = (cycle < 0) | (cycle >= len(edges) - 1)
    return np.where(outside, -1, number * ROWS.max_rows + cycle)


def _standing_joints(q: Array, move: IntArray, rest: Mask) -> Mask:
    """Whether a joint stands still (n, nq): in rests, and in moves without its motion."""
    still = np.repeat(rest[:, None], q.shape[1], axis=1)
    for number in np.unique(move):
        rows = np.flatnonzero((move == number) & ~rest)
        if rows.size:
            joints = np.flatnonzero(np.ptp(q[rows], axis=0) < ROWS.still_range)
            still[np.ix_(rows, joints)] = True
    return still


def _blocks(log: Log, size: int, stride: int) -> tuple[IntArray, IntArray, Mask]:
    """First sample of every row, its move from 0, and whether the arm rests."""
    starts, of_move, rest = list[IntArray](), list[IntArray](), list[Mask]()
    number = 0
    for move in log.moves:
        for part in _parts(log, move):
            first = np.arange(part.start, part.end - size + 1, size * stride)
            # a rest belongs to the previous move; the first rest belongs to the first move
            number += not part.at_rest
            starts.append(first)
            of_move.append(np.full(len(first), max(number - 1, 0)))
            rest.append(np.full(len(first), part.at_rest))
    if not starts:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0, dtype=bool)
    return np.concatenate(starts), np.concatenate(of_move), np.concatenate(rest)


def _parts(log: Log, move: LogMove) -> list[LogMove]:
    """The move itself, or the blocks of a long move."""
    if move.at_rest or move.end - move.start <= ROWS.max_move_duration * log.rate:
        return [move]
    length, gap = int(ROWS.block_duration * log.rate), int(ROWS.block_gap * log.rate)
    starts = range(move.start, move.end - length // 2, length + gap)
    return [LogMove(start, min(start + length, move.end), False) for start in starts]
