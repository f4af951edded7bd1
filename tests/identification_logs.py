"""Logs of simulated motions with known true figures and noise, as arrays, `Log` and CSV.

Torques come from Pinocchio's recursion and the formulas below, not from the code under test.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from joulepath import (
    Identification,
    IdentificationOptions,
    Log,
    LogMove,
    Payload,
    Robot,
    Validation,
    load_robot,
)
from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.results import PowerErrors, TorqueErrors
from tests.by_pinocchio import torques_of

GRAVITY = np.array([0.0, 0.0, -9.81])
WITHOUT_SPLIT = IdentificationOptions(held_out=0.0)
FAR = 4.0
"""Standard deviations that one of a thousand figures exceeds [1]."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the sensors: positions [rad], speeds [rad/s], currents [A], power
    [W]."""

    q: float = 2e-6
    v: float = 1e-3
    current: float = 0.02
    power: float = 0.5


SILENT = Noise(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Truth:
    """The arm as it is, arrays (nq,):

    tau_f = (coulomb + load·|tau_rigid|)·v/sqrt(v² + knee²) + viscous·v + offset, i = (tau_rigid +
    rotor·a + tau_f) / torque_constant, power = max(0, idle + Σ (tau·v + copper·i² +
    inverter_linear·|i|)).
    """

    coulomb: Array
    viscous: Array
    load: Array
    offset: Array
    rotor_inertia: Array
    torque_constant: Array
    copper: Array
    inverter_linear: Array
    idle_power: float
    knee: float = 1e-3
    payload: Payload = field(default_factory=Payload)


def truth_of(robot: Robot, seed: int = 0, payload: Payload | None = None) -> Truth:
    """A unit of the robot with load friction and with figures some ten per cent off."""
    random = np.random.default_rng(seed)
    drives, law, nq = robot.drives, robot.friction, robot.nq

    def near(values: Array, spread: float) -> Array:
        return np.asarray(values * random.uniform(1 - spread, 1 + spread, nq))

    # the curved part of the robot's law counts as Coulomb friction of its size at 0.5 rad/s
    coulomb = law.coulomb + law.curved * np.arcsinh(0.5 / law.speed)
    return Truth(
        coulomb=near(coulomb, 0.3),
        viscous=near(law.viscous + 0.1 * law.coulomb + 0.1, 0.3),
        load=np.where(np.arange(nq) < 3, 0.06, 0.0),
        offset=random.uniform(-0.05, 0.05, nq) * np.abs(coulomb),
        rotor_inertia=near(drives.rotor_inertia, 0.15),
        torque_constant=drives.torque_constant.copy(),
        copper=near(drives.copper, 0.2),
        inverter_linear=np.full(nq, 0.1),
        idle_power=float(robot.electronics.idle_power * random.uniform(0.9, 1.1)),
        payload=payload or Payload(),
    )


@dataclass(frozen=True)
class Recording:
    """The record of a controller.

    Times (n,) [s], q, v, a, current, torque, temperature (n, nq), power (n,), and the row ranges of
    its moves. v, current and power have noise, `exact_*` has none.
    """

    robot: Robot
    rate: float
    time: Array
    q: Array
    v: Array
    a: Array
    current: Array
    torque: Array
    power: Array
    temperature: Array
    exact_q: Array
    exact_v: Array
    moves: tuple[LogMove, ...]
    payload: Payload

    def log(self, meaning: EffortMeaning = "current", name: str | None = None) -> Log:
        """The log as its reader gives it, with the exact acceleration."""
        return Log(
            robot=self.robot.name,
            time=self.time,
            q=self.q,
            v=self.v,
            a=self.a,
            effort=self.current if meaning == "current" else self.torque,
            effort_meaning=meaning,
            power=self.power,
            temperature=self.temperature,
            payload=self.payload,
            rate=self.rate,
            moves=self.moves,
            name=name,
        )


def recorded(
    robot: Robot,
    truth: Truth,
    moves: int = 10,
    rate: float = 125.0,
    seed: int = 0,
    noise: Noise | None = None,
    closed: bool = False,
    cycles: int = 1,
) -> Recording:
    """Random motions from rest to rest, half a second of rest before, between and after them.

    The first two lead from one end to another and back: the same motion twice, in both directions.
    If `closed`, the last one ends at the start of the first, and all are repeated in `cycles`.
    """
    random = np.random.default_rng(seed)
    q, v, a, ranges = _motions(robot, moves, rate, random, closed, cycles)
    tau_rigid = rigid_torques(robot, truth, q, v, a)
    sign = v / np.sqrt(v * v + truth.knee**2)
    friction = (
        (truth.coulomb + truth.load * np.abs(tau_rigid)) * sign + truth.viscous * v + truth.offset
    )
    torque = tau_rigid + truth.rotor_inertia * a + friction
    current = torque / truth.torque_constant
    parts = torque * v + truth.copper * current**2 + truth.inverter_linear * np.abs(current)
    power = np.maximum(0.0, truth.idle_power + parts.sum(axis=1))
    sizes = Noise() if noise is None else noise

    def noisy(values: Array, size: float) -> Array:
        return np.asarray(values + random.normal(0.0, 1.0, values.shape) * size)

    measured = noisy(current, sizes.current)
    return Recording(
        robot=robot,
        rate=rate,
        time=np.arange(len(q)) / rate,
        q=noisy(q, sizes.q),
        v=noisy(v, sizes.v),
        a=a,
        current=measured,
        torque=measured * truth.torque_constant,
        power=noisy(power, sizes.power),
        temperature=np.full(q.shape, 30.0) + np.linspace(0.0, 2.0, len(q))[:, None],
        exact_q=q,
        exact_v=v,
        moves=ranges,
        payload=truth.payload,
    )


def rigid_torques(robot: Robot, truth: Truth, q: Array, v: Array, a: Array) -> Array:
    """Torques (n, nq) [N·m] of links and payload, without rotors, by Pinocchio."""
    model = robot.loaded_model(
        truth.payload.mass, truth.payload.com, truth.payload.inertia, GRAVITY
    )
    model.armature = np.zeros(model.nv)
    return torques_of(model, q, v, a)


def _motions(
    robot: Robot,
    count: int,
    rate: float,
    random: np.random.Generator,
    closed: bool,
    cycles: int,
) -> tuple[Array, Array, Array, tuple[LogMove, ...]]:
    """q, v, a (n, nq) of quintic moves, and the rows of moves and rests."""
    limits, nq = robot.limits, robot.nq
    low, high = np.maximum(limits.q_min, -1.5), np.minimum(limits.q_max, 1.5)
    ends = [random.uniform(low, high) for _ in range(count + 1)]
    if count > 1:
        ends[2] = ends[0]
    if closed:
        ends[-1] = ends[0]
        ends += ends[1:] * (cycles - 1)
    rest = round(0.5 * rate)
    parts: list[tuple[Array, Array, Array]] = [_still(ends[0], rest)]
    ranges, row = [LogMove(0, rest, True)], rest
    for begin, end in pairwise(ends):
        # 60 % of the limits in speed, of 15/8 Δq/T and 5.774 Δq/T²; the nearest whole number of
        # steps
        span = np.abs(end - begin)
        needed = (
            max((1.875 * span / limits.v_max).max(), np.sqrt((5.774 * span / limits.a_max).max()))
            / 0.6
        )
        steps = round(needed * rate)
        x = np.arange(1, steps) / steps
        s = x**3 * (10 - 15 * x + 6 * x**2)
        ds = 30 * x**2 * (1 - x) ** 2 * rate / steps
        dds = 60 * x * (1 - 3 * x + 2 * x**2) * (rate / steps) ** 2
        move = end - begin
        parts += [
            (begin + np.outer(s, move), np.outer(ds, move), np.outer(dds, move)),
            _still(end, rest),
        ]
        ranges += [
            LogMove(row, row + steps - 1, False),
            LogMove(row + steps - 1, row + steps - 1 + rest, True),
        ]
        row += steps - 1 + rest
    q, v, a = (np.concatenate(each) for each in zip(*parts, strict=True))
    assert q.shape == (row, nq)
    return q, v, a, tuple(ranges)


def _still(q: Array, rows: int) -> tuple[Array, Array, Array]:
    zeros = np.zeros((rows, len(q)))
    return np.tile(q, (rows, 1)), zeros, zeros


Form = Literal["own", "rtde", "ros"]


def csv_of(
    recording: Recording,
    form: Form = "own",
    *,
    without: str = "",
    effort: EffortMeaning = "current",
    separator: str = ",",
    decimal: str = ".",
    time: Array | None = None,
    units: Literal["rad", "deg"] = "rad",
    first: int = 0,
) -> bytes:
    """The recording as a CSV file of one of the three forms.

    `without` names groups to leave out, some of `v`, `a`, `i`, `P`, `T`. `time` replaces the times;
    `first` is the number of the first joint of an RTDE header.
    """
    nq, scale = recording.robot.nq, 180 / np.pi if units == "deg" else 1.0
    stamps = recording.time if time is None else time
    numbers = range(first, nq + first) if form == "rtde" else range(1, nq + 1)
    forms: dict[str, dict[str, str | None]] = {
        "own": {
            "q": "q{}",
            "v": "v{}",
            "a": "a{}",
            "i": "i{}" if effort == "current" else "tau{}",
            "T": None,
        },
        "rtde": {
            "q": "actual_q_{}",
            "v": "actual_qd_{}",
            "a": "target_qdd_{}",
            "i": "actual_current_{}",
            "T": "joint_temperatures_{}",
        },
        "ros": {"q": "position{}", "v": "velocity{}", "a": None, "i": "effort{}", "T": None},
    }
    names = forms[form]
    efforts = recording.current if effort == "current" else recording.torque
    values = {
        "q": recording.q * scale,
        "v": recording.v * scale,
        "a": recording.a * scale,
        "i": efforts,
    }
    values["T"] = recording.temperature
    header, columns = [{"own": "t", "rtde": "timestamp", "ros": "time"}[form]], [stamps[:, None]]
    for group, pattern in names.items():
        if pattern is not None and group not in without:
            header += [pattern.format(k) for k in numbers]
            columns.append(values[group])
    if "P" not in without and form != "ros":
        power = recording.power[:, None]
        header += ["P"] if form == "own" else ["actual_robot_voltage", "actual_robot_current"]
        columns += [power] if form == "own" else [np.full_like(power, 48.0), power / 48.0]
    line = separator.join(["%.12g", *["%.9g"] * (len(header) - 1)])
    lines = [line % tuple(row) for row in np.hstack(columns).tolist()]
    if decimal != ".":
        lines = [each.replace(".", decimal) for each in lines]
    return "\n".join([separator.join(header), *lines]).encode() + b"\n"


def with_current(recording: Recording, current: Array) -> Recording:
    """The recording with other currents (n, nq) [A]."""
    return replace(
        recording, current=current, torque=current * recording.robot.drives.torque_constant
    )


def written(found: Identification) -> Robot:
    """The robot with the figures of the document, as in a file."""
    document = json.loads(json.dumps(found.document("2026-01-31"), allow_nan=False))
    return load_robot(found.robot.name, figures=document)


def torque_errors(found: Validation | None) -> tuple[TorqueErrors, TorqueErrors]:
    """Errors of the torques by the fitted figures, and by the robot's own."""
    assert found is not None and found.fitted.torque is not None and found.own.torque is not None
    return found.fitted.torque, found.own.torque


def power_errors(found: Validation | None) -> tuple[PowerErrors, PowerErrors]:
    """Errors of the power by the fitted figures, and by the robot's own."""
    assert found is not None and found.fitted.power is not None and found.own.power is not None
    return found.fitted.power, found.own.power


def off_the_model(log: Log, effect: float, seed: int) -> Log:
    """The log with an extra power in every move: normal, with a standard deviation of
    `effect` [W].
    """
    random, power = np.random.default_rng([seed, 1]), np.array(log.power)
    for move in log.moves:
        if not move.at_rest:
            power[move.start : move.end] += random.normal() * effect
    return replace(log, power=power)
