"""Bounds on the torques of a motion between its samples.

Torques are known at samples. Between two samples, the smooth torque of bodies and rotors deviates
from its chord by at most a bound from second differences, even at jumps of jerk. Friction rises
with speed: over an interval it lies between its values at the least and at the greatest speed. At
the reversal of a joint, friction changes sign within a fraction of a millisecond, and a peak
between two samples may exceed both by some thousandths. Intervals that may hold such a peak are
divided until the bound is as sharp as requested.
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
"""Function for torques (k, nq) [N·m] of rigid bodies and rotors at q [rad], v [rad/s], a [rad/s²],
(k, nq) each.
"""


@dataclass(frozen=True)
class TorqueBoundSettings:
    """Division of intervals."""

    parts: int = 8
    """Parts of a divided interval. More parts need fewer divisions, but more samples."""
    max_divisions: int = 4
    """Largest number of divisions: from 1 ms to 0.25 µs, an interval in which a jump of jerk
    changes a torque by less than 1e-6 of its limit.
    """
    resolution: float = 1e-6
    """Largest excess of a bound over the greatest sample, relative to the torque limit; the
    tolerance of the certificate.
    """
    near_limit: float = 0.99
    """Torque relative to its limit below which the bound of a joint need not be sharp, unless it is
    the greatest of all joints.
    """
    far_below: float = 0.8
    """Torque relative to its limit, with friction of any sign, below which the greatest samples
    serve as bounds: torques between samples exceed them by some thousandths.
    """
    steady_change: float = 0.5
    """Change of a joint's speed over an interval, relative to the speed, up to which its friction
    is smooth there.
    """


TORQUE_BOUND = TorqueBoundSettings()


@dataclass(frozen=True)
class TorqueSamples:
    """Samples of m intervals at p + 1 evenly spaced instants.

    `t` (m, p + 1) [s] are the times; speeds `v` [rad/s], accelerations `a` [rad/s²] and torques
    `tau` of rigid bodies and rotors [N·m] have the shape (m, p + 1, nq).
    """

    t: Array
    v: Array
    a: Array
    tau: Array
    friction: Array | None = None
    """Friction torques (m, p + 1, nq) [N·m] if they are known already."""

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
    settings: TorqueBoundSettings = TORQUE_BOUND,
) -> Array:
    """Upper bounds (nq,) [N·m] on the limited torques of a motion, at its samples and between them.

    If all torques are far from their limits, the bounds are the greatest samples.

    Args:
        arm: arm with its payload, friction and limits.
        curve: motion q(t) [rad].
        torques: torques of the motion without friction.
        samples: samples that are known already, dense enough for second differences to show the
            curvature.
        settings: division of intervals.
    """
    limit = arm.active_limits.tau_max
    smooth, friction = limited_parts(arm, samples.tau, samples.v, samples.a, samples.friction)
    greatest_sum = np.abs(smooth).max(axis=(0, 1)) + np.abs(friction).max(axis=(0, 1))
    if (greatest_sum <= settings.far_below * limit).all():
        return np.asarray(np.abs(smooth + friction).max(axis=(0, 1)))
    bound = greatest = np.zeros_like(limit)
    for _ in range(settings.max_divisions):
        at_samples, between = _bounds(arm, samples, settings.steady_change)
        greatest = np.maximum(greatest, at_samples / limit)
        ratio = (between / limit).reshape(-1, len(limit))
        undecided = (ratio > greatest + settings.resolution) & (
            ratio > min(float(greatest.max()), settings.near_limit)
        )
        divided = _marked_rows(undecided)
        ratio[divided] = 0.0
        bound = np.maximum(bound, ratio.max(axis=0))
        if not len(divided):
            return np.asarray(np.maximum(bound, greatest) * limit)
        low, high = (t.ravel()[divided] for t in (samples.t[:, :-1], samples.t[:, 1:]))
        samples = TorqueSamples.of(
            curve, torques, np.linspace(low, high, settings.parts + 1, axis=1)
        )
    at_samples, between = _bounds(arm, samples, settings.steady_change)
    return np.asarray(
        np.maximum.reduce([bound * limit, greatest * limit, at_samples, between.max(axis=(0, 1))])
    )


def _marked_rows(marked: Mask) -> Indices:
    """Rows of an array (k, nq) with a marked entry. A reduction over so few columns would take ten
    times as long.
    """
    return np.unique(np.nonzero(marked)[0])


def _bounds(arm: Arm, samples: TorqueSamples, steady_change: float) -> tuple[Array, Array]:
    """Greatest absolute limited torques (nq,) [N·m] at the samples, and bounds (m, p, nq) between
    samples.
    """
    v, a = samples.v, samples.a
    smooth, friction = limited_parts(arm, samples.tau, v, a, samples.friction)
    total = smooth + friction
    size = np.abs(total)
    between = np.maximum(size[:, :-1], size[:, 1:]) + _chord_deviation(total)
    if arm.robot.torque_side == "motor":
        slack = _chord_deviation(v)
        slowest, fastest = _smaller_end(v) - slack, slack - _smaller_end(-v)
        least_speed = np.maximum(np.maximum(slowest, -fastest), 0.0)
        unsteady = _marked_rows(
            (fastest - slowest > steady_change * least_speed).reshape(-1, v.shape[2])
        )
        if len(unsteady):
            # Friction depends on the load, too: evaluated with the loads at both ends of the
            # interval.
            loads = [
                (_rows_of(tau, unsteady), _rows_of(a, unsteady))
                for tau, a in zip(_ends(samples.tau), _ends(a), strict=True)
            ]
            least, most = (
                np.array(
                    [
                        friction_torque(
                            arm.friction_law, arm.drives, tau, _rows_of(speed, unsteady), a
                        )
                        for tau, a in loads
                    ]
                )
                for speed in (slowest, fastest)
            )
            lower = _rows_of(_smaller_end(smooth), unsteady) + least.min(axis=0)
            upper = _rows_of(-_smaller_end(-smooth), unsteady) + most.max(axis=0)
            sharp = np.maximum(np.abs(lower), np.abs(upper)) + _rows_of(
                _chord_deviation(smooth), unsteady
            )
            between.reshape(-1, v.shape[2])[unsteady] = sharp
    return np.asarray(size.max(axis=(0, 1))), between


def _rows_of(x: Array, rows: Indices) -> Array:
    """Rows of x (m, p, nq), numbered through all m · p rows."""
    return np.asarray(x.reshape(-1, x.shape[2])[rows])


def _ends(x: Array) -> tuple[Array, Array]:
    """Values of x (m, p + 1, nq) at the beginnings and at the ends of the intervals, (m, p, nq)
    each.
    """
    return x[:, :-1], x[:, 1:]


def _smaller_end(x: Array) -> Array:
    """Smaller (m, p, nq) of the two values of x (m, p + 1, nq) at the ends of every interval."""
    return np.asarray(np.minimum(*_ends(x)))


def _chord_deviation(x: Array) -> Array:
    """Bound (m, p, nq) on the deviation of x (m, p + 1, nq) from its chord between two samples.

    A jump J of the slope at a share f of an interval of length h changes the second differences at
    its two ends by J h (1 - f) and J h f, and x by at most J h f (1 - f). This is at most a quarter
    of the sum of both, or, at the first and the last interval, the only known second difference. A
    smooth x deviates from its chord by an eighth of a second difference.
    """
    bend = np.abs(np.diff(x, n=2, axis=1))
    if not bend.shape[1]:
        return np.zeros_like(x[:, 1:])
    return np.concatenate([bend[:, :1], (bend[:, :-1] + bend[:, 1:]) / 4, bend[:, -1:]], axis=1)
