"""Rest-to-rest motions along the straight line in joint space: quintic, trapezoid, the controller's default."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from models.robot import Array, Limits
from optimizer.problem.problem import Problem
from optimizer.trajectories import bspline
from optimizer.trajectories.quadrature import LOBATTO, lobatto_nodes
from optimizer.trajectories.spline import Spline


@dataclass(frozen=True)
class SampledMotion:
    """A motion as quadrature samples: t, weights (k,) [s], q, v, a (k, nq), and the exact peaks (nq,) of its rates.

    The weights add up to the duration. A motion of no duration has one sample of weight zero.
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
        """The same path and law in another duration: v falls with the factor k, a with k², jerk with k³."""
        if self.duration == 0:
            return rest(self.q[0], duration)
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


def rest(q: Array, duration: float) -> SampledMotion:
    """Standing still at q (nq,); the duration may be zero."""
    if duration > 0:
        return quintic(q, q, duration)
    none = np.zeros(len(q))
    return SampledMotion(np.zeros(1), np.zeros(1), q[None], none[None], none[None], none, none, none)


def quintic(q_start: Array, q_goal: Array, duration: float) -> SampledMotion:
    """q = q_start + Δ (10 τ³ - 15 τ⁴ + 6 τ⁵), τ = t / T: at rest, v = a = 0, at both ends.

    Peaks: 15/8 Δ/T, 10/√3 Δ/T², 60 Δ/T³.
    """
    tau, weights = lobatto_nodes(np.array([0.0, 1.0]))
    law = np.stack(
        [
            tau**3 * (10 - 15 * tau + 6 * tau**2),
            30 * (tau * (1 - tau)) ** 2 / duration,
            60 * tau * (1 - tau) * (1 - 2 * tau) / duration**2,
        ]
    )
    peaks = np.array([15 / 8 / duration, 10 / math.sqrt(3) / duration**2, 60 / duration**3])
    return _sampled(tau * duration, weights * duration, q_start, q_goal - q_start, law, peaks)


def trapezoid(problem: Problem, q_start: Array, q_goal: Array, duration: float) -> SampledMotion:
    """A trapezoid of speed in a given duration, all joints in step, speeding up and slowing down for `blend_time`."""
    blend = float(blend_time(problem.arm.active_limits, q_goal - q_start, np.asarray(duration)))
    return _trapezoid(q_start, q_goal, duration, blend)


def blend_time(limits: Limits, displacement: Array, duration: Array) -> Array:
    """How long (...,) [s] trapezoids of speed over `displacement` (..., nq) speed up, and slow down, in durations T
    (...,).

    T/3 each: of all trapezoids that one has the least ∫ a² dt. Where T/3 breaks the speed limit it is less, where it
    breaks the acceleration limit more; where nothing holds both, T/3 stays.
    """
    # speed Δ / (T - b) ≤ v_max, and acceleration Δ / (b (T - b)) ≤ a_max
    longest = np.minimum(duration / 2, duration - (np.abs(displacement) / limits.v_max).max(axis=-1))
    discriminant = duration**2 - 4 * (np.abs(displacement) / limits.a_max).max(axis=-1)
    shortest = np.where(discriminant >= 0, (duration - np.sqrt(np.maximum(discriminant, 0))) / 2, np.inf)
    blend = duration / 3
    return np.asarray(np.where(shortest <= longest, np.clip(blend, np.minimum(shortest, longest), longest), blend))


def controller_default(problem: Problem, q_start: Array, q_goal: Array) -> SampledMotion:
    """The robot's own controller at its default speed and acceleration, or the limits where those are tighter.

    The joint that needs longest leads with a trapezoid; the others keep in step with it (UR script manual, `movej`).
    """
    limits, default = problem.arm.active_limits, problem.arm.robot.default_motion
    displacement = np.abs(q_goal - q_start)
    # 1 / (greatest speed and acceleration of the law s(t) from 0 to 1 that all joints share)
    slow = float((displacement / np.minimum(limits.v_max, default.velocity)).max())
    lazy = float((displacement / np.minimum(limits.a_max, default.acceleration)).max())
    if slow == 0:
        return rest(q_start, 0.0)
    blend = lazy / slow
    if blend < slow:
        return _trapezoid(q_start, q_goal, slow + blend, blend)
    return _trapezoid(q_start, q_goal, 2 * math.sqrt(lazy), math.sqrt(lazy))


def quintic_spline(q_start: Array, q_goal: Array, duration: float) -> Spline:
    """The rest-to-rest quintic as a spline of one span."""
    knots = bspline.clamped(np.array([0.0, 1.0])) * duration
    return Spline(bspline.DEGREE, knots, np.repeat([q_start, q_goal], bspline.REST_POINTS, axis=0))


def _trapezoid(q_start: Array, q_goal: Array, duration: float, blend: float) -> SampledMotion:
    """Constant acceleration for `blend` [s], constant speed, and the same back to rest."""
    tau, weights = lobatto_nodes(np.unique([0.0, blend / duration, 1 - blend / duration, 1.0]))
    t = tau * duration
    speed = 1 / (duration - blend)
    acceleration = speed / blend
    # by panel, not by node: at a jump the nodes of either side keep to their own side
    middle = np.repeat(t.reshape(-1, len(LOBATTO)).mean(axis=1), len(LOBATTO))
    left = duration - t
    phases = [middle < blend, middle > duration - blend]
    law = np.stack(
        [
            np.select(phases, [acceleration * t**2 / 2, 1 - acceleration * left**2 / 2], speed * (t - blend / 2)),
            np.select(phases, [acceleration * t, acceleration * left], speed),
            np.select(phases, [acceleration, -acceleration], 0.0),
        ]
    )
    return _sampled(t, weights * duration, q_start, q_goal - q_start, law, np.array([speed, acceleration, np.inf]))


def _sampled(t: Array, weights: Array, q_start: Array, displacement: Array, law: Array, peaks: Array) -> SampledMotion:
    """The straight line q_start + s(t) · displacement; `law` (3, k) holds s and its derivatives, `peaks` (3,) the
    rates'."""
    s, rate, acceleration = law[:, :, None] * displacement
    with np.errstate(invalid="ignore"):  # infinite jerk of a joint that stays where it is: none
        peak_v, peak_a, peak_jerk = np.nan_to_num(np.abs(displacement) * peaks[:, None], nan=0.0, posinf=np.inf)
    return SampledMotion(t, weights, q_start + s, rate, acceleration, peak_v, peak_a, peak_jerk)
