"""What other methods spend between the same ends, and the optimiser's first guesses.

- `trapezoid`: trapezoid of speed, all joints in step, in our duration
- `quintic`: rest-to-rest quintic, all joints in step, in our duration
- `ruckig`: time-optimal under limits of speed, acceleration and jerk (Berscheid, Kröger 2021); knows no torque
- `ruckig_slowed`: the same path and law, scaled evenly to our duration
- `controller_default`: the robot's own controller at its default speed and acceleration, a leading-axis trapezoid

All go from the start to the nearest goal, and wait there, each in the time that it leaves of a cycle. A trapezoid's
acceleration jumps: its jerk is unbounded, so it is never within a jerk limit, and says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import ruckig

from models.robot import Array, Limits
from optimizer import bspline
from optimizer.dwell import holding_power
from optimizer.energy import breakdown
from optimizer.problem import Problem
from optimizer.solution import Baseline, BaselineName, Energy, Spline
from optimizer.verify import limit_ratios

RATIO_TOLERANCE = 1e-6  # as the certificate's
PANELS = 72  # least number of quadrature panels over a motion: error of the energy below 1e-5 of it
CLOSEST_BREAKS = (
    1e-5  # share of a motion: nearer jumps of jerk are one, for rounding would make jerk of its own between them
)

# Gauss-Lobatto points and weights on [0, 1]: exact for polynomials of degree 9, and with a panel's ends among them,
# where torque peaks when acceleration jumps or bends
_INNER = np.sqrt((7 + 2 * math.sqrt(7) * np.array([1, -1])) / 21)
LOBATTO = (1 + np.array([-1.0, -_INNER[0], -_INNER[1], _INNER[1], _INNER[0], 1.0])) / 2
LOBATTO_WEIGHTS = np.array([2, 14 - math.sqrt(7), 14 + math.sqrt(7), 14 + math.sqrt(7), 14 - math.sqrt(7), 2]) / 60

Torques = Callable[[Array, Array, Array], Array]


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


def baselines(
    problem: Problem,
    q_start: Array,
    q_goals: Array,
    duration: float,
    ours: float,
    torques: Torques,
    potential: Callable[[Array], float],
    keeps_path: Callable[[Array, Array], bool],
) -> list[Baseline]:
    """Every baseline from q_start (nq,) to the nearest of q_goals (m, nq), which are within the position limits.

    `duration` > 0 [s] and `ours` [J, of the objective] are of the motion they are compared with. `torques` maps q, v, a
    (k, nq) to rigid-body-and-rotor torques (k, nq), `potential` joint positions (nq,) to the potential energy [J];
    `keeps_path` says of samples q, v (k, nq) whether they hit nothing and hold the limits along the path.
    """
    motions = guesses(problem, q_start, nearest(problem, q_start, q_goals), duration)
    # one call for all: a compiled kernel works through samples in blocks
    q, v, a = (np.concatenate([getattr(motion, name) for motion in motions.values()]) for name in ("q", "v", "a"))
    ends = np.cumsum([len(motion.t) for motion in motions.values()])[:-1]
    result, hold = [], 0.0
    if problem.cycle is not None:
        goal, still = nearest(problem, q_start, q_goals)[None], np.zeros((1, len(q_start)))
        hold = float(holding_power(problem, torques(goal, still, still))[0])
    for (name, motion), tau in zip(motions.items(), np.split(torques(q, v, a), ends), strict=True):
        energy = motion_energy(problem, motion, tau, potential)
        if problem.cycle is not None:
            energy = energy.with_dwell(problem.cycle.dwell(problem, hold, motion.duration))
        theirs = energy.electrical.total if problem.objective == "electrical" else energy.mechanical.total
        result.append(
            Baseline(
                name=name,
                duration=motion.duration,
                electrical=energy.electrical.total,
                mechanical=energy.mechanical.total,
                within_limits=within_limits(problem, motion, tau) and keeps_path(motion.q, motion.v),
                saving=saving(ours, theirs),
            )
        )
    return result


def guesses(problem: Problem, q_start: Array, q_goal: Array, duration: float) -> dict[BaselineName, SampledMotion]:
    """The motions behind the baselines; all but `ruckig` and `controller_default` take `duration` [s]."""
    fastest = time_optimal(problem.active_limits, q_start, q_goal)
    return {
        "trapezoid": trapezoid(problem, q_start, q_goal, duration),
        "quintic": quintic(q_start, q_goal, duration),
        "ruckig": fastest,
        "ruckig_slowed": fastest.scaled_to(duration),
        "controller_default": controller_default(problem, q_start, q_goal),
    }


def nearest(problem: Problem, q_start: Array, q_goals: Array) -> Array:
    """The goal (nq,) of q_goals (m, nq) that all joints reach first at their speed limits; of equals, least travel."""
    travel = np.abs(np.asarray(q_goals) - q_start)
    times = (travel / problem.active_limits.v_max).max(axis=1)
    # rounded, so that goals that differ by rounding only count as equals
    return np.asarray(q_goals[np.lexsort((travel.sum(axis=1), np.round(times, 9)))[0]])


def saving(ours: float, theirs: float) -> float:
    """1 - ours / theirs; the sign stays right where regeneration makes theirs negative. 0 where theirs is nothing."""
    return (theirs - ours) / abs(theirs) if theirs else 0.0


def motion_energy(problem: Problem, motion: SampledMotion, tau: Array, potential: Callable[[Array], float]) -> Energy:
    """Breakdown of a motion that begins and ends at rest, waiting left out, from its torques (k, nq)."""
    return breakdown(motion.weights, motion.v, tau, potential(motion.q[-1]) - potential(motion.q[0]), problem)


def within_limits(problem: Problem, motion: SampledMotion, tau: Array) -> bool:
    """Whether a motion holds every limit: its exact peaks of the rates, positions and motor torques at its samples.

    A motion that takes longer than the cycle does not.
    """
    if problem.cycle is not None and motion.duration > problem.cycle.time * (1 + RATIO_TOLERANCE):
        return False
    limits = problem.active_limits
    tau_motor = tau + problem.friction_law.torque(motion.v)
    jerk = np.where(np.isfinite(limits.j_max), motion.peak_jerk, 0.0)  # where none is in force, unbounded jerk is fine
    ratios = limit_ratios(limits, motion.q, motion.peak_v, motion.peak_a, jerk, tau_motor)
    return all(ratio <= 1 + RATIO_TOLERANCE for ratio in ratios.values())


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
    tau, weights = _nodes(np.array([0.0, 1.0]))
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
    blend = float(blend_time(problem.active_limits, q_goal - q_start, np.asarray(duration)))
    return _trapezoid(q_start, q_goal, duration, blend)


def blend_time(limits: Limits, travel: Array, duration: Array) -> Array:
    """How long (...,) [s] trapezoids of speed over `travel` (..., nq) speed up, and slow down, in durations T (...,).

    T/3 each: of all trapezoids that one has the least ∫ a² dt. Where T/3 breaks the speed limit it is less, where it
    breaks the acceleration limit more; where nothing holds both, T/3 stays.
    """
    # speed Δ / (T - b) ≤ v_max, and acceleration Δ / (b (T - b)) ≤ a_max
    longest = np.minimum(duration / 2, duration - (np.abs(travel) / limits.v_max).max(axis=-1))
    discriminant = duration**2 - 4 * (np.abs(travel) / limits.a_max).max(axis=-1)
    shortest = np.where(discriminant >= 0, (duration - np.sqrt(np.maximum(discriminant, 0))) / 2, np.inf)
    blend = duration / 3
    return np.asarray(np.where(shortest <= longest, np.clip(blend, np.minimum(shortest, longest), longest), blend))


def controller_default(problem: Problem, q_start: Array, q_goal: Array) -> SampledMotion:
    """The robot's own controller at its default speed and acceleration, or the limits where those are tighter.

    The joint that needs longest leads with a trapezoid; the others keep in step with it (UR script manual, `movej`).
    """
    limits, default = problem.active_limits, problem.robot.default_motion
    travel = np.abs(q_goal - q_start)
    # 1 / (greatest speed and acceleration of the law s(t) from 0 to 1 that all joints share)
    slow = float((travel / np.minimum(limits.v_max, default.velocity)).max())
    lazy = float((travel / np.minimum(limits.a_max, default.acceleration)).max())
    if slow == 0:
        return rest(q_start, 0.0)
    blend = lazy / slow
    if blend < slow:
        return _trapezoid(q_start, q_goal, slow + blend, blend)
    return _trapezoid(q_start, q_goal, 2 * math.sqrt(lazy), math.sqrt(lazy))


def time_optimal(limits: Limits, q_start: Array, q_goal: Array) -> SampledMotion:
    """Ruckig's motion from rest to rest, joints ending together, each of up to seven phases of constant jerk.

    Raises RuntimeError should Ruckig find no motion: between configurations at rest there always is one.
    """
    found = _ruckig(limits, q_start, q_goal)
    if found.duration == 0:
        return rest(q_start, 0.0)
    profiles = found.profiles[0]
    tau, weights = _nodes(_breaks(found))
    t = tau * found.duration
    states = np.array([found.at_time(instant) for instant in t.tolist()])
    return SampledMotion(
        t=t,
        weights=weights * found.duration,
        q=states[:, 0],
        v=states[:, 1],
        a=states[:, 2],
        peak_v=np.abs([profile.v for profile in profiles]).max(axis=1),
        peak_a=np.abs([profile.a for profile in profiles]).max(axis=1),
        peak_jerk=np.abs([profile.j for profile in profiles]).max(axis=1),
    )


def time_optimal_spline(limits: Limits, q_start: Array, q_goal: Array) -> Spline:
    """Ruckig's motion without loss: a spline with threefold knots wherever the jerk of a joint jumps.

    Between equal configurations, which takes Ruckig no time at all, it stands still for a second.
    """
    found = _ruckig(limits, q_start, q_goal)
    if found.duration == 0:
        return Spline(bspline.DEGREE, bspline.clamped(np.array([0.0, 1.0])), np.tile(q_start, (bspline.DEGREE + 1, 1)))
    breaks = _breaks(found)
    inner = breaks[1:-1][np.diff(breaks[:-1]) > CLOSEST_BREAKS]
    knots = bspline.clamped(np.concatenate([[0.0], np.repeat(inner, 3), [1.0]]))
    at = bspline.greville(knots)
    points = np.asarray(np.linalg.solve(bspline.basis_matrix(knots, at), _positions(found, at)), dtype=float)
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = q_start, q_goal
    return Spline(bspline.DEGREE, knots * found.duration, points)


def quintic_spline(q_start: Array, q_goal: Array, duration: float) -> Spline:
    """The rest-to-rest quintic as a spline of one span."""
    knots = bspline.clamped(np.array([0.0, 1.0])) * duration
    return Spline(bspline.DEGREE, knots, np.repeat([q_start, q_goal], bspline.REST_POINTS, axis=0))


def time_optimal_positions(limits: Limits, q_start: Array, q_goal: Array, at: Array) -> Array:
    """Where Ruckig's motion is (k, nq) at the shares `at` (k,) of its duration."""
    return _positions(_ruckig(limits, q_start, q_goal), at)


def _positions(found: ruckig.Trajectory, at: Array) -> Array:
    return np.array([found.at_time(instant)[0] for instant in (at * found.duration).tolist()])


def _ruckig(limits: Limits, q_start: Array, q_goal: Array) -> ruckig.Trajectory:
    given = ruckig.InputParameter(len(q_start))
    given.current_position, given.target_position = q_start.tolist(), q_goal.tolist()
    given.max_velocity, given.max_acceleration = limits.v_max.tolist(), limits.a_max.tolist()
    given.max_jerk = limits.j_max.tolist()
    found = ruckig.Trajectory(len(q_start))
    result = ruckig.Ruckig(len(q_start)).calculate(given, found)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise RuntimeError(f"Ruckig found no motion: {result}")
    return found


def _breaks(found: ruckig.Trajectory) -> Array:
    """Where in [0, 1] the jerk of any joint jumps, both ends included, ascending."""
    phases = np.array([profile.t for profile in found.profiles[0]])
    ends = np.append(phases.cumsum(axis=1), [0.0, found.duration]) / found.duration
    return np.asarray(np.unique(np.round(ends, 12)))


def _trapezoid(q_start: Array, q_goal: Array, duration: float, blend: float) -> SampledMotion:
    """Constant acceleration for `blend` [s], constant speed, and the same back to rest."""
    tau, weights = _nodes(np.unique([0.0, blend / duration, 1 - blend / duration, 1.0]))
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


def _sampled(t: Array, weights: Array, q_start: Array, travel: Array, law: Array, peaks: Array) -> SampledMotion:
    """The straight line q_start + s(t) · travel; `law` (3, k) holds s and its derivatives, `peaks` (3,) the rates'."""
    s, rate, acceleration = law[:, :, None] * travel
    with np.errstate(invalid="ignore"):  # infinite jerk of a joint that stays where it is: none
        peak_v, peak_a, peak_jerk = np.nan_to_num(np.abs(travel) * peaks[:, None], nan=0.0, posinf=np.inf)
    return SampledMotion(t, weights, q_start + s, rate, acceleration, peak_v, peak_a, peak_jerk)


def _nodes(breaks: Array) -> tuple[Array, Array]:
    """Quadrature nodes and weights (k,) over [0, 1] whose panels end at every break."""
    parts = np.maximum(np.ceil(np.diff(breaks) * PANELS), 1).astype(int)
    edges = np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(breaks[:-1], breaks[1:], parts, strict=True)]
        + [breaks[-1:]]
    )
    lengths = np.diff(edges)[:, None]
    return (edges[:-1, None] + lengths * LOBATTO).ravel(), (lengths * LOBATTO_WEIGHTS).ravel()
