"""Simulated logs in place of real logs that are not public, with further errors besides noise.

Friction differs from day to day and decreases while the arm warms up. The gears have ripple, the
drives filter and quantise the currents, positions are quantised by their sensors, and times have
jitter. The fitted model has none of these effects.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.reading import read_log
from joulepath.optimizer.problem.arm import Payload
from tests.identification_logs import (
    Noise,
    Recording,
    Truth,
    csv_of,
    recorded,
    rigid_torques,
    with_current,
)

RATE = 500.0
"""Sampling rate [Hz]."""
WARMING = 0.03
"""Relative decrease of the friction over a log [1]."""
RIPPLE = 0.01
"""Amplitude of the ripple of the gears relative to the friction [1]."""
RIPPLE_PERIODS = 37.0
"""Number of periods of the ripple per turn of the joint [1]."""
FILTER = 0.004
"""Time constant of the filter of the logged current in the drive [s]."""
CURRENT_STEP = 0.005
"""Resolution of the logged current [A]."""
POSITION_STEP = 1e-5
"""Resolution of the logged positions [rad]."""
JITTER = 1e-4
"""Largest jitter of the logged times [s]."""
SENSED_FRICTION = 0.15
"""Share of the friction that a torque sensor behind the gears measures [1]."""
TORQUE_SENSOR = Noise(current=0.005)
"""Noise of a torque sensor behind the gears: 0.05 N·m at 10 N·m/A."""


def day_of(
    robot: Robot,
    truth: Truth,
    seed: int,
    friction: float | Array,
    moves: int,
    payload: Payload | None = None,
    noise: Noise | None = None,
) -> Recording:
    """The recording of an arm on one day.

    Args:
        robot: the robot.
        truth: true figures of the arm.
        seed: seed of the motion and of the errors.
        friction: friction on this day over the true friction, of all joints or (nq,).
        moves: number of moves.
        payload: payload, if any.
        noise: noise of the channels.
    """
    random = np.random.default_rng([seed, 7])
    parts = {name: getattr(truth, name) * friction for name in ("coulomb", "viscous", "load")}
    today = replace(truth, **parts, knee=2e-3, payload=payload or Payload())
    exact = recorded(robot, today, moves=moves, rate=RATE, seed=seed, noise=noise)
    # the arm moves between the nominal time of a sample and its actual time
    shift = np.append(0.0, random.uniform(-JITTER, JITTER, len(exact.time) - 1))
    q = exact.q + exact.exact_v * shift[:, None]
    rigid = rigid_torques(robot, today, exact.exact_q, exact.exact_v, exact.a)
    drag = exact.torque - rigid - today.rotor_inertia * exact.a - today.offset
    cooler = WARMING * np.linspace(0.5, -0.5, len(q))[:, None]
    moving = np.abs(exact.exact_v) > 1e-3
    ripple = (
        RIPPLE
        * today.coulomb
        * np.sin(RIPPLE_PERIODS * exact.exact_q + random.uniform(0, 6, robot.nq))
        * moving
    )
    current = _of_drive((exact.torque + cooler * drag + ripple) / today.torque_constant)
    return replace(
        with_current(exact, current),
        time=exact.time + shift,
        q=np.round(q / POSITION_STEP) * POSITION_STEP,
    )


def _of_drive(current: Array) -> Array:
    """Currents (n, nq) [A] with the filter and the resolution of the drive."""
    keep = float(np.exp(-1 / (RATE * FILTER)))
    filtered, _ = lfilter([1 - keep], [1, -keep], current, axis=0, zi=keep * current[:1])
    return np.asarray(np.round(filtered / CURRENT_STEP) * CURRENT_STEP)


def log_of(
    robot: Robot, recording: Recording, payload: Payload | None = None, torque: bool = False
) -> Log:
    """The log that the reader reads from the file of a recording, with torques or with currents."""
    body = csv_of(recording, "own", without="aP", effort="torque" if torque else "current")
    return read_log(
        body,
        robot,
        LogOptions(payload=payload or recording.payload, effort="torque" if torque else "current"),
    ).log


def behind_the_gears(truth: Truth) -> Truth:
    """The truth of an arm with torque sensors behind the gears."""
    return replace(
        truth,
        coulomb=SENSED_FRICTION * truth.coulomb,
        viscous=SENSED_FRICTION * truth.viscous,
        load=SENSED_FRICTION * truth.load,
        rotor_inertia=0.0 * truth.rotor_inertia,
    )
