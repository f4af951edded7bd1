"""Energy of other methods' motions between the same ends, which also are initial guesses.

- `trapezoid`: trapezoidal speed, all joints synchronised, in our duration
- `quintic`: rest-to-rest quintic, all joints synchronised, in our duration
- `ruckig`: time-optimal under limits of speed, acceleration and jerk (Berscheid, Kröger 2021);
  without torque limits
- `ruckig_slowed`: the same motion, its time scaled to our duration
- `straight`: Ruckig's motion along the straight line in joints, its time scaled to our duration
- `controller_default`: the robot's own controller at its default speed and acceleration, a
  leading-axis trapezoid; left out for a robot without published defaults

All go from the start to the nearest goal and wait there until the end of the dwell, if there is
one. The acceleration of a trapezoid jumps: its jerk is unbounded, so it is never within a jerk
limit.

A saving is claimed only against a motion within every limit, in the same cycle time: without a
dwell, the shorter of both motions waits at its goal until the longer one ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.dwell import holding_power, holding_times, with_dwell
from joulepath.optimizer.dynamics.interval import (
    MotionEnergy,
    arm_spread,
    saving_intervals,
)
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import breakdown, friction_torque, saving
from joulepath.optimizer.dynamics.sensitivity import energy_sensitivity, waiting_sensitivity
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE, excess_text, limit_ratios
from joulepath.optimizer.motion.ruckig_motion import straight, time_optimal
from joulepath.optimizer.motion.time_scalings import (
    SampledMotion,
    controller_default,
    quintic,
    trapezoid,
)
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.result.baseline import Baseline, BaselineName, Standing
from joulepath.optimizer.result.energy import Energy, SavingInterval, Sensitivity

NOT_IN_CYCLES: tuple[BaselineName, ...] = ("trapezoid", "quintic", "ruckig")
"""Baselines of a motion with which no cycle is compared. Others may be, outside of a limit too."""

Torques = Callable[[Array, Array, Array], Array]
Broken = Callable[[Sequence[Array], Sequence[Array], Sequence[Array]], list[list[str]]]


def baselines(
    problem: Problem,
    q_start: Array,
    q_goals: Array,
    duration: float,
    ours: float,
    torques: Torques,
    potential: Callable[[Array], float],
    broken_on_the_way: Broken,
) -> list[Baseline]:
    """Every baseline from the start to the nearest goal.

    Args:
        problem: the problem.
        q_start: start configuration, shape (nq,) [rad].
        q_goals: goal configurations within the position limits, shape (m, nq) [rad].
        duration: duration of our motion, positive [s].
        ours: objective of our motion [J].
        torques: rigid-body and rotor torques (k, nq) from q, v, a (k, nq).
        potential: potential energy [J] of joint positions (nq,).
        broken_on_the_way: for samples q, v of motions and samples of their paths, the limits along
            the path that each motion breaks, and its collisions.
    """
    q_goal = nearest(problem, q_start, q_goals)
    motions = guesses(problem, q_start, q_goal, duration)
    # one call for all motions: a compiled kernel works through samples in blocks
    q, v, a = (
        np.concatenate([getattr(motion, name) for motion in motions.values()])
        for name in ("q", "v", "a")
    )
    ends = np.cumsum([len(motion.t) for motion in motions.values()])[:-1]
    result = []
    held = standing(problem.arm, q_goal, torques)
    # most take the straight line in joints, of which the same samples are checked for collisions
    on_line = motions["straight"].q
    broken = broken_on_the_way(
        [motion.q for motion in motions.values()],
        [motion.v for motion in motions.values()],
        [motion.q if "ruckig" in name else on_line for name, motion in motions.items()],
    )
    for (name, motion), tau, words in zip(
        motions.items(), np.split(torques(q, v, a), ends), broken, strict=True
    ):
        result.append(compared(problem, name, motion, tau, held, ours, potential, words))
    return result


def compared(
    problem: Problem,
    name: BaselineName,
    motion: SampledMotion,
    tau: Array,
    held: Standing,
    ours: float,
    potential: Callable[[Array], float],
    broken: Sequence[str],
) -> Baseline:
    """A motion as a baseline; `with_savings` corrects its saving for the cycle time.

    Args:
        problem: the problem.
        name: name of the baseline.
        motion: its motion.
        tau: torques of the motion, shape (k, nq) [N·m].
        held: the arm after the motion.
        ours: objective of our motion [J].
        potential: potential energy [J] of joint positions (nq,).
        broken: limits along the path that the motion breaks, and collisions, in words.
    """
    arm = problem.arm
    tau_friction = friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    energy = motion_energy(problem, motion, tau, potential, tau_friction)
    if problem.dwell is not None:
        energy = with_dwell(energy, problem.dwell, arm, held.power, motion.duration)
    reasons = [*broken_limits(problem, motion, tau, tau_friction), *broken]
    sensitivity = None
    if not reasons or name not in NOT_IN_CYCLES:
        sensitivity = _sensitivity(problem, motion, tau, held, tau_friction)
    return Baseline(
        name=name,
        duration=motion.duration,
        electrical=energy.electrical.total,
        mechanical=energy.mechanical.total,
        saving=saving(ours, energy.of(problem.objective)),
        reason="; ".join(reasons) or None,
        sensitivity=sensitivity,
        at_goal=held,
    )


def _sensitivity(
    problem: Problem, motion: SampledMotion, tau: Array, held: Standing, tau_friction: Array
) -> Sensitivity:
    """Sensitivity of the energy of a motion and its dwell; arguments as of `compared`."""
    arm, dwell, spread = problem.arm, problem.dwell, arm_spread(problem.arm)
    moving = energy_sensitivity(
        motion.weights, motion.q, motion.v, motion.a, tau, arm, spread, tau_friction
    )
    if dwell is None:
        return moving
    times = holding_times(dwell, motion.duration)
    return moving + waiting_sensitivity(arm, held.q, held.tau, *times, dwell, spread)


def standing(arm: Arm, q: Array, torques: Torques) -> Standing:
    """The arm at rest in q (nq,) [rad], held by its motors."""
    still = np.zeros((1, len(q)))
    held = torques(q[None], still, still)[0]
    return Standing(q, held, float(holding_power(arm, held)))


def with_savings(
    table: list[Baseline], problem: Problem, ours: MotionEnergy, at_goal: Standing
) -> list[Baseline]:
    """The baselines with savings in the same cycle time and their intervals.

    Baselines outside of a limit have neither.

    Args:
        table: baselines.
        problem: the problem.
        ours: our motion.
        at_goal: the arm at its end.
    """
    usable = [each for each in table if each.within_limits]
    values = {each.name: each.saving for each in usable}
    savings = dict[BaselineName, SavingInterval]()
    if problem.objective == "electrical":
        longer, theirs = list[MotionEnergy](), list[MotionEnergy]()
        for each in usable:
            assert each.sensitivity is not None
            known = MotionEnergy(each.electrical, each.sensitivity, each.duration)
            wait = 0.0 if problem.dwell is not None else each.duration - ours.duration
            wait = 0.0 if abs(wait) <= RATIO_TOLERANCE * ours.duration else wait
            longer.append(waited(ours, at_goal, wait, problem.arm) if wait > 0 else ours)
            theirs.append(waited(known, each.at_goal, -wait, problem.arm) if wait < 0 else known)
            values[each.name] = saving(longer[-1].energy, theirs[-1].energy)
        savings = dict(zip(values, saving_intervals(longer, theirs, problem.arm), strict=True))
    return [
        replace(each, saving=values.get(each.name), saving_interval=savings.get(each.name))
        for each in table
    ]


def waited(known: MotionEnergy, at: Standing, time: float, arm: Arm) -> MotionEnergy:
    """A motion with a wait of `time` [s] after it, while the motors hold the arm."""
    more = waiting_sensitivity(arm, at.q, at.tau, time, 0.0, Dwell(time), arm_spread(arm))
    return replace(
        known, energy=known.energy + at.power * time, sensitivity=known.sensitivity + more
    )


def guesses(
    problem: Problem, q_start: Array, q_goal: Array, duration: float
) -> dict[BaselineName, SampledMotion]:
    """The motions of the baselines.

    All but `ruckig` and `controller_default` take `duration` [s]. The last is left out for a robot
    without a known default motion.
    """
    limits = problem.arm.active_limits
    fastest, default = time_optimal(limits, q_start, q_goal), problem.arm.robot.default_motion
    motions: dict[BaselineName, SampledMotion] = {
        "trapezoid": trapezoid(limits, q_start, q_goal, duration),
        "quintic": quintic(q_start, q_goal, duration),
        "ruckig": fastest,
        "ruckig_slowed": fastest.scaled_to(duration),
        "straight": straight(limits, q_start, q_goal).scaled_to(duration),
    }
    if default is not None:
        motions["controller_default"] = controller_default(limits, default, q_start, q_goal)
    return motions


def nearest(problem: Problem, q_start: Array, q_goals: Array) -> Array:
    """The goal (nq,) among q_goals (m, nq) that all joints reach first at their speed limits.

    Among equal goals it has the least displacement.
    """
    displacement = np.abs(np.asarray(q_goals) - q_start)
    times = (displacement / problem.arm.active_limits.v_max).max(axis=1)
    # times that differ by rounding are equal
    return np.asarray(q_goals[np.lexsort((displacement.sum(axis=1), np.round(times, 9)))[0]])


def motion_energy(
    problem: Problem,
    motion: SampledMotion,
    tau: Array,
    potential: Callable[[Array], float],
    tau_friction: Array | None = None,
) -> Energy:
    """Energy of a motion from rest to rest, without waiting.

    Args:
        problem: the problem.
        motion: the motion.
        tau: its torques, shape (k, nq) [N·m].
        potential: potential energy [J] of joint positions (nq,).
        tau_friction: friction torques, shape (k, nq) [N·m], if they are known.
    """
    gain = potential(motion.q[-1]) - potential(motion.q[0])
    return breakdown(
        motion.weights, motion.v, motion.a, tau, gain, problem.arm, tau_friction=tau_friction
    )


def broken_limits(
    problem: Problem, motion: SampledMotion, tau: Array, tau_friction: Array | None = None
) -> list[str]:
    """The limits that a motion breaks, in words; a motion longer than the dwell breaks it too.

    The peaks of the rates are exact, positions and torques are checked at samples. The arguments
    are those of `motion_energy`.
    """
    late = problem.dwell is not None and motion.duration > problem.dwell.time * (
        1 + RATIO_TOLERANCE
    )
    limits = problem.arm.active_limits
    tau_limited = limited_torque(problem.arm, tau, motion.v, motion.a, tau_friction)
    # without a limit, unbounded jerk is allowed
    jerk = np.where(np.isfinite(limits.j_max), motion.peak_jerk, 0.0)
    ratios = limit_ratios(limits, motion.q, motion.peak_v, motion.peak_a, jerk, tau_limited)
    return [
        *(["longer than the dwell"] if late else []),
        *(
            excess_text(name, ratio)
            for name, ratio in ratios.items()
            if ratio > 1 + RATIO_TOLERANCE
        ),
    ]
