"""Rest-to-rest motions along the straight line in joint space: quintic, trapezoid, and the default
motion of the robot's controller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, DefaultMotion, Limits
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.quadrature import LOBATTO, lobatto_nodes
from joulepath.optimizer.motion.quintic import PEAKS, derivatives
from joulepath.optimizer.motion.spline import Spline


@dataclass(frozen=True)
class SampledMotion:
    """Motion as quadrature samples: t, weights (k,) [s], q, v, a (k, nq), and the exact peaks (nq,)
    of its rates.

    The weights add up to the duration. A motion of zero duration has one sample of weight zero.
    """

    t: Array
    weights: Array
    q: Array
    v: Array
    a: Array
    peak_v: Array
    peak_a: Array
    peak_jerk: Array

    @property
    def duration(self) -> float:
        """Length of the motion [s]."""
        return float(self.t[-1])

    def scaled_to(self, duration: float) -> SampledMotion:
        """The motion along the same path with time scaled by k to `duration` [s]: v / k, a / k²,
        jerk / k³.
        """
        if self.duration == 0:
            return standstill(self.q[0], duration)
        k = duration / self.duration
        return replace(
            self,
            t=self.t * k,
            weights=self.weights * k,
            v=self.v / k,
            a=self.a / k**2,
            peak_v=self.peak_v / k,
            peak_a=self.peak_a / k**2,
            peak_jerk=self.peak_jerk / k**3,
        )


def standstill(q: Array, duration: float) -> SampledMotion:
    """No motion at q (nq,) for `duration` ≥ 0 [s]."""
    if duration > 0:
        return quintic(q, q, duration)
    none = np.zeros(len(q))
    return SampledMotion(
        np.zeros(1), np.zeros(1), q[None], none[None], none[None], none, none, none
    )


def quintic(q_start: Array, q_goal: Array, duration: float) -> SampledMotion:
    """q = q_start + s(t / T) · (q_goal - q_start) with the quintic s: v = a = 0 at both ends."""
    tau, weights = lobatto_nodes(np.array([0.0, 1.0]))
    powers = np.array([1.0, duration, duration**2, duration**3])
    law = derivatives(tau) / powers[:3, None]
    return _sampled(
        tau * duration, weights * duration, q_start, q_goal - q_start, law, PEAKS / powers[1:]
    )


def trapezoid(limits: Limits, q_start: Array, q_goal: Array, duration: float) -> SampledMotion:
    """Trapezoidal speed profile in `duration` [s], synchronous in all joints, with ramps of
    `blend_time`.
    """
    blend = float(blend_time(limits, q_goal - q_start, np.asarray(duration)))
    return _trapezoid(q_start, q_goal, duration, blend)


def blend_time(limits: Limits, displacement: Array, duration: Array) -> Array:
    """Time (...,) [s] of acceleration and of deceleration of a trapezoidal profile over
    `displacement` (..., nq) [rad].

    T/3 of the duration T (...,) [s] minimises ∫ a² dt over all trapezoids. The time is shorter if
    T/3 exceeds the speed limit, and longer if T/3 exceeds the acceleration limit. If no time
    satisfies both limits, it is T/3.
    """
    # Speed Δ / (T - b) ≤ v_max, and acceleration Δ / (b (T - b)) ≤ a_max.
    longest = np.minimum(
        duration / 2, duration - (np.abs(displacement) / limits.v_max).max(axis=-1)
    )
    discriminant = duration**2 - 4 * (np.abs(displacement) / limits.a_max).max(axis=-1)
    shortest = np.where(
        discriminant >= 0, (duration - np.sqrt(np.maximum(discriminant, 0))) / 2, np.inf
    )
    blend = duration / 3
    return np.asarray(
        np.where(shortest <= longest, np.clip(blend, np.minimum(shortest, longest), longest), blend)
    )


def controller_default(
    limits: Limits, default: DefaultMotion, q_start: Array, q_goal: Array
) -> SampledMotion:
    """Motion of the robot's controller at its default speed and acceleration, or at the limits if
    these are tighter.

    The joint that needs longest moves with a trapezoidal profile, and the others move synchronously
    (UR script manual, `movej`).
    """
    duration, blend = default_times(limits, default, q_goal - q_start)
    return (
        _trapezoid(q_start, q_goal, duration, blend) if duration > 0 else standstill(q_start, 0.0)
    )


def default_times(
    limits: Limits, default: DefaultMotion, displacement: Array
) -> tuple[float, float]:
    """Duration and time of acceleration [s] of the controller's default motion over `displacement`
    (nq,) [rad].
    """
    distance = np.abs(displacement)
    # 1 / (greatest speed and acceleration of the time scaling s(t) from 0 to 1 of all joints).
    slow = float((distance / np.minimum(limits.v_max, default.velocity)).max())
    lazy = float((distance / np.minimum(limits.a_max, default.acceleration)).max())
    if slow == 0:
        return 0.0, 0.0
    blend = lazy / slow
    return (slow + blend, blend) if blend < slow else (2 * math.sqrt(lazy), math.sqrt(lazy))


def quintic_spline(q_start: Array, q_goal: Array, duration: float) -> Spline:
    """The rest-to-rest quintic as a spline of one span."""
    knots = bspline.clamped(np.array([0.0, 1.0])) * duration
    return Spline(bspline.DEGREE, knots, np.repeat([q_start, q_goal], bspline.REST_POINTS, axis=0))


def _trapezoid(q_start: Array, q_goal: Array, duration: float, blend: float) -> SampledMotion:
    """Motion with constant acceleration for `blend` [s], constant speed, and the same
    deceleration.
    """
    tau, weights = lobatto_nodes(np.unique([0.0, blend / duration, 1 - blend / duration, 1.0]))
    t = tau * duration
    # By panel, not by node: at a jump of acceleration, a node belongs to the phase of its panel.
    middle = np.repeat(t.reshape(-1, len(LOBATTO)).mean(axis=1), len(LOBATTO))
    speed = 1 / (duration - blend)
    law, peaks = trapezoid_law(t, duration, blend, middle), np.array([speed, speed / blend, np.inf])
    return _sampled(t, weights * duration, q_start, q_goal - q_start, law, peaks)


def trapezoid_law(t: Array, duration: float, blend: float, phase: Array | None = None) -> Array:
    """s, ds/dt, d²s/dt² (3, k) of a trapezoidal profile from 0 to 1 at times t (k,) [s], with ramps
    of `blend` [s].

    `phase` (k,) [s] are times inside the phases of the instants, by default the instants
    themselves.
    """
    phase = t if phase is None else phase
    speed, left = 1 / (duration - blend), duration - t
    acceleration = speed / blend
    phases = [phase < blend, phase > duration - blend]
    return np.stack(
        [
            np.select(
                phases,
                [acceleration * t**2 / 2, 1 - acceleration * left**2 / 2],
                speed * (t - blend / 2),
            ),
            np.select(phases, [acceleration * t, acceleration * left], speed),
            np.select(phases, [acceleration, -acceleration], 0.0),
        ]
    )


def _sampled(
    t: Array, weights: Array, q_start: Array, displacement: Array, law: Array, peaks: Array
) -> SampledMotion:
    """Motion q = q_start + s(t) · displacement; `law` (3, k) holds s, ds/dt, d²s/dt², `peaks` (3,)
    the greatest rates of s.
    """
    s, rate, acceleration = law[:, :, None] * displacement
    with np.errstate(invalid="ignore"):  # Infinite jerk times zero displacement is zero jerk.
        peak_v, peak_a, peak_jerk = np.nan_to_num(
            np.abs(displacement) * peaks[:, None], nan=0.0, posinf=np.inf
        )
    return SampledMotion(t, weights, q_start + s, rate, acceleration, peak_v, peak_a, peak_jerk)
