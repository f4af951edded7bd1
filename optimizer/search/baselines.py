"""Energy of other methods' motions between the same ends; these motions are also initial guesses of
the optimiser.

- `trapezoid`: trapezoidal speed, all joints synchronised, in our duration
- `quintic`: rest-to-rest quintic, all joints synchronised, in our duration
- `ruckig`: time-optimal under limits of speed, acceleration and jerk (Berscheid, Kröger 2021);
  without torque limits
- `ruckig_slowed`: the same motion, its time scaled to our duration
- `straight`: Ruckig's motion along the straight line in joints, its time scaled to our duration
- `controller_default`: the robot's own controller at its default speed and acceleration, a
  leading-axis trapezoid; left
  out for a robot whose maker publishes none

All go from the start to the nearest goal and wait there until the end of the dwell, if there is
one. The acceleration of a trapezoid jumps: its jerk is unbounded, so it is never within a jerk
limit.

A saving is claimed only against a motion within every limit, in the same cycle time: where there is
no dwell, the shorter of both motions waits at its goal until the longer one ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.dwell import dwell_energy, holding_power, holding_times
from joulepath.optimizer.dynamics.interval import (
    MotionEnergy,
    arm_spread,
    saving_interval,
    saving_intervals,
)
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import breakdown, friction_torque
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
from joulepath.optimizer.result.energy import Energy, SavingInterval
from joulepath.optimizer.result.solution import Baseline, BaselineName, Standing

Torques = Callable[[Array, Array, Array], Array]
Broken = Callable[[Sequence[Array], Sequence[Array]], list[list[str]]]


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
    """Every baseline from q_start (nq,) to the nearest of q_goals (m, nq), which are within the
    position limits.

    `duration` > 0 [s] and `ours` [J, of the objective] are of the motion they are compared with.
    `torques` maps q, v, a (k, nq) to rigid-body-and-rotor torques (k, nq), `potential` joint
    positions (nq,) to the potential energy [J]; `broken_on_the_way` says of motions' samples q, v
    (k, nq) each which limits along the path they break, and what collides.
    """
    motions = guesses(problem, q_start, nearest(problem, q_start, q_goals), duration)
    # one call for all: a compiled kernel works through samples in blocks
    q, v, a = (
        np.concatenate([getattr(motion, name) for motion in motions.values()])
        for name in ("q", "v", "a")
    )
    ends = np.cumsum([len(motion.t) for motion in motions.values()])[:-1]
    result = []
    held = standing(problem.arm, nearest(problem, q_start, q_goals), torques)
    broken = broken_on_the_way(
        [motion.q for motion in motions.values()], [motion.v for motion in motions.values()]
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
    """A motion with torques tau (k, nq) as a baseline; after it, the arm stands as `held`. See
    `baselines`. Its saving is that over both motions alone, until `with_savings`.

    `broken` are the limits along the path that it breaks, and what collides, in words.
    """
    arm = problem.arm
    tau_friction = friction_torque(arm.friction_law, arm.drives, tau, motion.v, motion.a)
    energy = motion_energy(problem, motion, tau, potential, tau_friction)
    spread = arm_spread(arm)
    sensitivity = energy_sensitivity(
        motion.weights, motion.q, motion.v, motion.a, tau, arm, spread, tau_friction
    )
    if problem.dwell is not None:
        energy = energy.with_dwell(dwell_energy(problem.dwell, arm, held.power, motion.duration))
        times = holding_times(problem.dwell, motion.duration)
        sensitivity += waiting_sensitivity(arm, held.q, held.tau, *times, problem.dwell, spread)
    return Baseline(
        name=name,
        duration=motion.duration,
        electrical=energy.electrical.total,
        mechanical=energy.mechanical.total,
        saving=saving(ours, energy.of(problem.objective)),
        reason="; ".join([*broken_limits(problem, motion, tau, tau_friction), *broken]) or None,
        sensitivity=sensitivity,
        at_goal=held,
    )


def standing(arm: Arm, q: Array, torques: Torques) -> Standing:
    """An arm that its motors hold at q (nq,) [rad]."""
    still = np.zeros((1, len(q)))
    held = torques(q[None], still, still)[0]
    return Standing(q, held, float(holding_power(arm, held)))


def with_savings(
    table: list[Baseline], problem: Problem, ours: MotionEnergy, at_goal: Standing
) -> list[Baseline]:
    """The baselines with savings in the same cycle time, and their intervals; without, where they
    are not within every limit. `ours` is our motion, which ends as `at_goal`.
    """
    usable = [each for each in table if each.within_limits]
    savings: dict[str, SavingInterval | None] = dict.fromkeys(each.name for each in usable)
    values = {each.name: each.saving for each in usable}
    if problem.objective == "electrical":
        together = list[tuple[str, MotionEnergy]]()
        for each in usable:
            theirs = MotionEnergy(each.electrical, each.sensitivity, each.duration)
            wait = 0.0 if problem.dwell is not None else each.duration - ours.duration
            if abs(wait) <= RATIO_TOLERANCE * ours.duration:
                together.append((each.name, theirs))
                continue
            longer = waited(ours, at_goal, wait, problem.arm) if wait > 0 else ours
            theirs = waited(theirs, each.at_goal, -wait, problem.arm) if wait < 0 else theirs
            values[each.name] = saving(longer.energy, theirs.energy)
            savings[each.name] = saving_interval(longer, theirs, problem.arm)
        intervals = saving_intervals(ours, [known for _, known in together], problem.arm)
        savings |= {name: known for (name, _), known in zip(together, intervals, strict=True)}
    return [
        replace(each, saving=values.get(each.name), saving_interval=savings.get(each.name))
        for each in table
    ]


def waited(known: MotionEnergy, at: Standing, time: float, arm: Arm) -> MotionEnergy:
    """A motion and a wait of `time` [s] after it, the motors holding the arm."""
    more = waiting_sensitivity(arm, at.q, at.tau, time, 0.0, Dwell(time), arm_spread(arm))
    return replace(
        known, energy=known.energy + at.power * time, sensitivity=known.sensitivity + more
    )


def guesses(
    problem: Problem, q_start: Array, q_goal: Array, duration: float
) -> dict[BaselineName, SampledMotion]:
    """The motions behind the baselines; all but `ruckig` and `controller_default` take `duration`
    [s].

    The last one is left out for a robot whose controller's default motion is unknown.
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
    """The goal (nq,) of q_goals (m, nq) that all joints reach first at their speed limits; of
    equals, least displacement."""
    displacement = np.abs(np.asarray(q_goals) - q_start)
    times = (displacement / problem.arm.active_limits.v_max).max(axis=1)
    # rounded, so that goals that differ by rounding only count as equals
    return np.asarray(q_goals[np.lexsort((displacement.sum(axis=1), np.round(times, 9)))[0]])


def saving(ours: float, theirs: float) -> float:
    """1 - ours / theirs; the sign stays right where regeneration makes theirs negative. 0 where
    theirs is nothing.
    """
    return (theirs - ours) / abs(theirs) if theirs else 0.0


def motion_energy(
    problem: Problem,
    motion: SampledMotion,
    tau: Array,
    potential: Callable[[Array], float],
    tau_friction: Array | None = None,
) -> Energy:
    """Breakdown of a motion that begins and ends at rest, waiting left out, from its torques (k,
    nq); `tau_friction` (k, nq) are those of friction if they are known."""
    gain = potential(motion.q[-1]) - potential(motion.q[0])
    return breakdown(
        motion.weights, motion.v, motion.a, tau, gain, problem.arm, tau_friction=tau_friction
    )


def broken_limits(
    problem: Problem, motion: SampledMotion, tau: Array, tau_friction: Array | None = None
) -> list[str]:
    """The limits that a motion breaks, in words: its exact peaks of the rates, positions and
    torques at its samples.

    `tau_friction` as of `motion_energy`. A motion that takes longer than the dwell breaks it, too.
    """
    late = problem.dwell is not None and motion.duration > problem.dwell.time * (
        1 + RATIO_TOLERANCE
    )
    limits = problem.arm.active_limits
    tau_limited = limited_torque(problem.arm, tau, motion.v, motion.a, tau_friction)
    jerk = np.where(
        np.isfinite(limits.j_max), motion.peak_jerk, 0.0
    )  # where none is in force, unbounded jerk is fine
    ratios = limit_ratios(limits, motion.q, motion.peak_v, motion.peak_a, jerk, tau_limited)
    return [
        *(["longer than the dwell"] if late else []),
        *(
            excess_text(name, ratio)
            for name, ratio in ratios.items()
            if ratio > 1 + RATIO_TOLERANCE
        ),
    ]
