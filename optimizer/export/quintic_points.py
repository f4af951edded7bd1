"""Points between which the quintics of a controller stay within a tolerance of the splines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.pieces import breaks
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.motion.spline import Spline, sample

NANOSECONDS = 1e9
"""Nanoseconds of a second."""


@dataclass(frozen=True)
class QuinticSettings:
    """Settings of the choice of points."""

    position_tolerance: float = 1e-4
    """Largest deviation from the spline [rad]."""
    velocity_tolerance: float = 1e-2
    """Largest deviation of the velocity from that of the spline [rad/s]."""
    max_points: int = 20_000
    """Largest number of points of a trajectory: about ten megabytes."""
    min_period: float = 1e-6
    """Smallest time between two points [s]; messages have whole nanoseconds."""
    checks: int = 15
    """Instants between two points at which the deviation is measured."""
    max_halvings: int = 20
    """Largest number of halvings of a piece; its length falls by a factor of a million."""


QUINTICS = QuinticSettings()


@dataclass(frozen=True)
class QuinticPoints:
    """Points of a trajectory."""

    nanoseconds: list[int]
    """Times from the start (k,) [ns]."""
    q: Array
    """Positions (k, nq) [rad]."""
    v: Array
    """Velocities (k, nq) [rad/s]."""
    a: Array
    """Accelerations (k, nq) [rad/s²]."""
    position: float
    """Largest deviation of the quintics from the splines [rad]."""
    velocity: float
    """Largest deviation of their velocities [rad/s]."""


def quintic_points(program: Program, format: str) -> QuinticPoints:
    """Points of a program, which a controller passes with position, velocity and acceleration.

    They are the ends of all polynomial pieces, with more points where a spline is no quintic or its
    acceleration jumps.

    Args:
        program: the motion.
        format: name of the format in error messages.

    Raises:
        FormatUnsuitable: there are too many points, or no points are sufficient.
    """
    times = [np.zeros(1)]
    rows = [np.stack(sample(program.moves[0].spline, np.zeros(1)), axis=1)]
    worst = np.zeros(2)
    for timed in program.timed:
        if isinstance(timed.step, Move):
            t, states, deviation = _points_of_move(timed.step.spline, timed.t0, format)
            worst = np.maximum(worst, deviation)
        elif timed.step.duration == 0:
            continue
        else:
            t = np.array([timed.t0, timed.t0 + timed.step.duration])
            states = np.repeat(rows[-1][-1:], 2, axis=0)
            states[:, 1:] = 0.0
        times.append(t[1:])
        rows.append(states[1:])
        if sum(map(len, times)) > QUINTICS.max_points:
            raise FormatUnsuitable(
                format,
                f"The trajectory would have more than {QUINTICS.max_points} points: export it move "
                f"by move, not as {format}.",
            )
    joined = np.concatenate(rows)
    nanoseconds = np.rint(np.concatenate(times) * NANOSECONDS).astype(int).tolist()
    return QuinticPoints(
        nanoseconds, joined[:, 0], joined[:, 1], joined[:, 2], float(worst[0]), float(worst[1])
    )


def _points_of_move(spline: Spline, t0: float, format: str) -> tuple[Array, Array, Array]:
    """Points of a move.

    Args:
        spline: motion of the move.
        t0: its start in the program [s].
        format: name of the format in error messages.

    Returns:
        Times in the program (k,) [s], states (k, 3, nq), and the largest deviations (2,).
    """
    settings = QUINTICS
    own = breaks(spline)
    own = own[np.append(True, np.diff(own) > settings.min_period)]
    own[-1] = spline.duration
    tolerances = np.array([[settings.position_tolerance], [settings.velocity_tolerance]])
    for _ in range(settings.max_halvings):
        states, deviation = _deviations(spline, own, t0)
        too_far = (deviation > tolerances / 2).any(axis=0)
        if not too_far.any():
            return own + t0, states, deviation.max(axis=1)
        own = np.sort(np.append(own, (own[:-1] + own[1:])[too_far] / 2))
        if len(own) > settings.max_points or np.diff(own).min() < settings.min_period:
            break
    raise FormatUnsuitable(
        format,
        "No number of points keeps the tolerance for this motion: export it as json, csv or npz.",
    )


def _deviations(spline: Spline, own: Array, t0: float) -> tuple[Array, Array]:
    """Deviations of quintics from a spline.

    Args:
        spline: motion of a move.
        own: times of the points in the move (k,) [s].
        t0: start of the move in the program [s].

    Returns:
        States at the points (k, 3, nq), and the largest deviations between them (2, k - 1).
    """
    states = np.stack(sample(spline, own), axis=1)
    # the message has times in whole nanoseconds
    rounded = np.rint((own + t0) * NANOSECONDS) / NANOSECONDS - t0
    lengths = np.diff(rounded)
    shares = np.arange(1, QUINTICS.checks + 1) / (QUINTICS.checks + 1)
    q, v = quintic(states, lengths, shares)
    t = np.clip(rounded[:-1] + shares[:, None] * lengths, 0.0, spline.duration)
    true_q, true_v = (spline.curve(t.ravel(), order).reshape(*t.shape, -1) for order in range(2))
    return states, np.stack(
        [np.abs(q - true_q).max(axis=(0, 2)), np.abs(v - true_v).max(axis=(0, 2))]
    )


def quintic(states: Array, lengths: Array, u: Array) -> tuple[Array, Array]:
    """Positions and velocities of quintics between states.

    The polynomial is that of the joint trajectory controller of ros2_control for points with
    position, velocity and acceleration, `Trajectory::interpolate_between_points` in
    joint_trajectory_controller/src/trajectory.cpp.

    Args:
        states: positions, velocities and accelerations (k, 3, nq) at the points.
        lengths: times between the points (k - 1,) [s].
        u: shares of these times.

    Returns:
        q [rad] and v [rad/s], shape (len(u), k - 1, nq).
    """
    T = lengths[:, None]
    (q0, v0, a0), (q1, v1, a1) = (np.moveaxis(each, 1, 0) for each in (states[:-1], states[1:]))
    v0, v1, a0, a1 = v0 * T, v1 * T, a0 * T**2, a1 * T**2
    gain = q1 - q0
    c = [
        q0,
        v0,
        a0 / 2,
        10 * gain - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * gain + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * gain - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1,
    ]
    u = u[:, None, None]
    q = sum(each * u**k for k, each in enumerate(c))
    v = sum(k * each * u ** (k - 1) for k, each in enumerate(c) if k)
    return np.asarray(q), np.asarray(v / T)
