"""Bounds on the torques of a motion between its samples.

Torque is known at instants. From one to the next, the smooth torque of bodies and rotors leaves the
chord between both values by at most what second differences show, even where jerk jumps. Friction
rises with speed: over an interval it lies between its values at the least and the greatest speed.
Where a joint reverses, friction changes sign within a fraction of a millisecond, and a peak between
two samples may be some thousandths above both. Intervals that might hold such a peak are divided
until the bound is as sharp as asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.dynamics.limited_torque import limited_parts
from joulepath.optimizer.dynamics.losses import friction_torque
from joulepath.optimizer.motion.quadrature import Indices
from joulepath.optimizer.problem.arm import Arm

Torques = Callable[[Array, Array, Array], Array]
"""Torques (k, nq) [N·m] of rigid bodies and rotors at q [rad], v [rad/s], a [rad/s²], shapes (k,
nq).
"""


@dataclass(frozen=True)
class Sharpness:
    """How far intervals are divided."""

    parts: int = 8
    """Parts of an interval that may hold a greater torque than any sample. More need fewer rounds,
    but more samples.
    """
    rounds: int = 4
    """Most divisions: from 1 ms to 0.25 µs, in which a jump of jerk changes a torque by less than
    1e-6 of its limit.
    """
    resolution: float = 1e-6
    """Torque over limit by which a bound may be above the greatest sample: what the certificate
    tolerates.
    """
    near: float = 0.99
    """Torque over limit below which a joint's own bound need not be sharp, unless it is the
    greatest of all joints.
    """
    far_below: float = 0.8
    """Torque over limit, with friction of any sign, below which the greatest samples are the
    bounds: what lies between samples is some thousandths above them."""
    steady: float = 0.5
    """Change of a joint's speed over an interval, relative to the speed, up to which its friction
    is smooth there.
    """


SHARPNESS = Sharpness()


@dataclass(frozen=True)
class TorqueSamples:
    """Samples of m intervals at p + 1 evenly spaced instants each: times t (m, p + 1) [s], and (m,
    p + 1, nq) speeds v [rad/s], accelerations a [rad/s²] and torques tau of rigid bodies and rotors
    [N·m]."""

    t: Array
    v: Array
    a: Array
    tau: Array

    @classmethod
    def of(cls, curve: BSpline, torques: Torques, t: Array) -> TorqueSamples:
        """Samples of a motion q(t) at times t (m, p + 1) [s]."""
        q, v, a = (curve(t.ravel(), order) for order in range(3))
        shape = (*t.shape, q.shape[1])
        return cls(t, v.reshape(shape), a.reshape(shape), torques(q, v, a).reshape(shape))


def torque_bounds(
    arm: Arm,
    curve: BSpline,
    torques: Torques,
    samples: TorqueSamples,
    sharpness: Sharpness = SHARPNESS,
) -> Array:
    """Upper bounds (nq,) [N·m] on the limited torques of a motion, at its samples and between them.

    Where no torque comes near its limit, they are the greatest at the samples.

    Args:
        arm: the arm with its payload, friction and limits.
        curve: the motion q(t) [rad].
        torques: its torques without friction.
        samples: those that are known already, dense enough that second differences show its
            curvature.
        sharpness: how far intervals are divided.
    """
    limit = arm.active_limits.tau_max
    smooth, friction = limited_parts(arm, samples.tau, samples.v, samples.a)
    most = np.abs(smooth).max(axis=(0, 1)) + np.abs(friction).max(axis=(0, 1))
    if (most <= sharpness.far_below * limit).all():
        return np.asarray(np.abs(smooth + friction).max(axis=(0, 1)))
    bound = greatest = np.zeros_like(limit)
    for _ in range(sharpness.rounds):
        at_samples, between = _bounds(arm, samples, sharpness.steady)
        greatest = np.maximum(greatest, at_samples / limit)
        ratio = (between / limit).reshape(-1, len(limit))
        open_ = (ratio > greatest + sharpness.resolution) & (
            ratio > min(float(greatest.max()), sharpness.near)
        )
        chosen = _rows(open_)
        ratio[chosen] = 0.0
        bound = np.maximum(bound, ratio.max(axis=0))
        if not len(chosen):
            return np.asarray(np.maximum(bound, greatest) * limit)
        low, high = (t.ravel()[chosen] for t in (samples.t[:, :-1], samples.t[:, 1:]))
        samples = TorqueSamples.of(
            curve, torques, np.linspace(low, high, sharpness.parts + 1, axis=1)
        )
    at_samples, between = _bounds(arm, samples, sharpness.steady)
    return np.asarray(
        np.maximum.reduce([bound * limit, greatest * limit, at_samples, between.max(axis=(0, 1))])
    )


def _rows(marked: Mask) -> Indices:
    """The rows of an array (k, nq) in which an entry is marked. A reduction over so few columns
    takes ten times as long."""
    return np.unique(np.nonzero(marked)[0])


def _bounds(arm: Arm, samples: TorqueSamples, steady: float) -> tuple[Array, Array]:
    """Greatest absolute limited torques (nq,) [N·m] at the samples, and bounds on them between
    samples (m, p, nq).
    """
    v, a = samples.v, samples.a
    smooth, friction = limited_parts(arm, samples.tau, v, a)
    total = smooth + friction
    size = np.abs(total)
    between = np.maximum(size[:, :-1], size[:, 1:]) + _off_chord(total)
    if arm.robot.torque_side == "motor":
        slack = _off_chord(v)
        slowest, fastest = _least(v) - slack, slack - _least(-v)
        least_speed = np.maximum(np.maximum(slowest, -fastest), 0.0)
        sudden = _rows((fastest - slowest > steady * least_speed).reshape(-1, v.shape[2]))
        if len(sudden):
            # friction depends on the load, too: its values with the loads at both ends of the
            # interval
            loads = [
                (_at(tau, sudden), _at(a, sudden))
                for tau, a in zip(_ends(samples.tau), _ends(a), strict=True)
            ]
            least, most = (
                np.array(
                    [
                        friction_torque(arm.friction_law, arm.drives, tau, _at(speed, sudden), a)
                        for tau, a in loads
                    ]
                )
                for speed in (slowest, fastest)
            )
            lower = _at(_least(smooth), sudden) + least.min(axis=0)
            upper = _at(-_least(-smooth), sudden) + most.max(axis=0)
            sharp = np.maximum(np.abs(lower), np.abs(upper)) + _at(_off_chord(smooth), sudden)
            between.reshape(-1, v.shape[2])[sudden] = sharp
    return np.asarray(size.max(axis=(0, 1))), between


def _at(x: Array, rows: Indices) -> Array:
    """Rows of x (m, p, nq), counted through all m · p of them."""
    return np.asarray(x.reshape(-1, x.shape[2])[rows])


def _ends(x: Array) -> tuple[Array, Array]:
    """The values of x (m, p + 1, nq) at the beginnings and at the ends of the intervals between
    samples, (m, p, nq).
    """
    return x[:, :-1], x[:, 1:]


def _least(x: Array) -> Array:
    """The lesser (m, p, nq) of the two values of x (m, p + 1, nq) around every interval."""
    return np.asarray(np.minimum(*_ends(x)))


def _off_chord(x: Array) -> Array:
    """By how much x (m, p + 1, nq) may leave the chord between two samples, (m, p, nq).

    A jump J of the slope at a share f of an interval of length h changes the second differences at
    its two ends by J h (1 − f) and J h f, and x by J h f (1 − f) at most: a quarter of their sum,
    or all of the one that is known at the ends of the samples. Where x is smooth, it leaves the
    chord by an eighth of a second difference.
    """
    bend = np.abs(np.diff(x, n=2, axis=1))
    if not bend.shape[1]:
        return np.zeros_like(x[:, 1:])
    return np.concatenate([bend[:, :1], (bend[:, :-1] + bend[:, 1:]) / 4, bend[:, -1:]], axis=1)
