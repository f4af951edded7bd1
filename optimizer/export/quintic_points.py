"""Points of a program between which a controller's own quintics stay within a tolerance of the
splines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.pieces import breaks
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.motion.spline import Spline, sample

POSITION_TOLERANCE, VELOCITY_TOLERANCE = 1e-4, 1e-2
"""Largest deviation from the spline [rad], [rad/s]."""
MOST_POINTS = 20_000
"""Most points of a trajectory: about ten megabytes."""
# times are messages of nanoseconds; points are further apart than this [s]
NANO, CLOSEST = 1e9, 1e-6
# instants between two points at which the deviation is measured
INSIDE = np.arange(1, 16) / 16
# halvings of a piece: its length falls by a factor of a million
MOST_HALVINGS = 20


@dataclass(frozen=True)
class QuinticPoints:
    """Times (k,) [ns] from the start; q, v, a (k, nq) in rad and s; largest deviations of the
    quintics between them from the splines [rad], [rad/s]."""

    nanoseconds: list[int]
    q: Array
    v: Array
    a: Array
    position: float
    velocity: float


def quintic_points(program: Program, format: str) -> QuinticPoints:
    """The ends of all polynomial pieces, and more points where a spline is no quintic or its
    acceleration jumps.

    The controller passes each point with its position, velocity and acceleration. Raises
    FormatUnsuitable if there are too many points.
    """
    times, rows, worst = (
        [np.zeros(1)],
        [np.stack(sample(program.moves[0].spline, np.zeros(1)), axis=1)],
        np.zeros(2),
    )
    for timed in program.timed:
        if isinstance(timed.step, Move):
            t, states, deviation = _of_move(timed.step.spline, timed.t0, format)
            worst = np.maximum(worst, deviation)
        else:
            t = np.array([timed.t0, timed.t0 + timed.step.duration])
            states = np.repeat(rows[-1][-1:], 2, axis=0)
            states[:, 1:] = 0.0
        times.append(t[1:])
        rows.append(states[1:])
        if sum(map(len, times)) > MOST_POINTS:
            raise FormatUnsuitable(
                format,
                f"The trajectory would have more than {MOST_POINTS} points: export it move by "
                f"move, not as {format}.",
            )
    joined = np.concatenate(rows)
    nanoseconds = np.rint(np.concatenate(times) * NANO).astype(int).tolist()
    return QuinticPoints(
        nanoseconds, joined[:, 0], joined[:, 1], joined[:, 2], float(worst[0]), float(worst[1])
    )


def _of_move(spline: Spline, t0: float, format: str) -> tuple[Array, Array, Array]:
    """Times (k,) [s] of the program, states (k, 3, nq), and the largest deviations (2,)."""
    own = breaks(spline)
    own = own[np.append(True, np.diff(own) > CLOSEST)]
    own[-1] = spline.duration
    for _ in range(MOST_HALVINGS):
        states, deviation = _deviations(spline, own, t0)
        too_far = (deviation > np.array([[POSITION_TOLERANCE], [VELOCITY_TOLERANCE]]) / 2).any(
            axis=0
        )
        if not too_far.any():
            return own + t0, states, deviation.max(axis=1)
        own = np.sort(np.append(own, (own[:-1] + own[1:])[too_far] / 2))
        if len(own) > MOST_POINTS or np.diff(own).min() < CLOSEST:
            break
    raise FormatUnsuitable(
        format,
        "No points of this motion hold the tolerance between them: export it as json, csv or npz.",
    )


def _deviations(spline: Spline, own: Array, t0: float) -> tuple[Array, Array]:
    """States (k, 3, nq) at times own (k,) [s] of a move that begins at t0 [s], and the largest
    deviations (2, k - 1) between them."""
    states = np.stack(sample(spline, own), axis=1)
    # what the controller knows: times in whole nanoseconds
    told = np.rint((own + t0) * NANO) / NANO - t0
    lengths = np.diff(told)
    q, v = quintic(states, lengths, INSIDE)
    t = np.clip(told[:-1] + INSIDE[:, None] * lengths, 0.0, spline.duration)
    true_q, true_v = (spline.curve(t.ravel(), order).reshape(*t.shape, -1) for order in range(2))
    return states, np.stack(
        [np.abs(q - true_q).max(axis=(0, 2)), np.abs(v - true_v).max(axis=(0, 2))]
    )


def quintic(states: Array, lengths: Array, u: Array) -> tuple[Array, Array]:
    """q and v (len(u), k - 1, nq) at the shares u of the time of k - 1 quintics between states (k,
    3, nq): q, v, a.

    `lengths` (k - 1,) [s]. The polynomial is that of the joint trajectory controller of
    ros2_control for points that have all three, `Trajectory::interpolate_between_points` in
    joint_trajectory_controller/src/trajectory.cpp.
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
