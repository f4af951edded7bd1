"""Motions of an answer's baselines as functions of time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import NoConfigurationFound, SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.ruckig_motion import straight_spline, time_optimal_spline
from joulepath.optimizer.motion.spline import lasting
from joulepath.optimizer.motion.time_scalings import (
    blend_time,
    default_times,
    quintic_spline,
    trapezoid_law,
)
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.planned import PlannedBaseline
from joulepath.optimizer.replay.reference import Course, course_of, reference
from joulepath.optimizer.result.baseline import BaselineName


@dataclass(frozen=True)
class BaselineSettings:
    """Tolerances for the goal of an answer's baselines."""

    duration_tolerance: float = 1e-6
    """Relative difference of a reported duration, which is exact [1]."""
    work_tolerance: float = 1e-3
    """Relative difference of a mechanical work, which depends on the quadrature [1]."""
    min_waiting: float = 1e-3
    """Share of a baseline's energy drawn while waiting, below which it is an error of the
    quadrature [1]."""
    same_duration: float = 1e-6
    """Relative difference of equal durations [1]."""
    sample_period: float = 1e-3
    """Period of the samples for the energy of a baseline [s]."""


BASELINES = BaselineSettings()


def courses(
    arm: Arm, q_start: Array, q_goal: Array, duration: float
) -> dict[BaselineName, tuple[Course, float]]:
    """Baselines between two configurations; see `search.baselines`.

    Args:
        arm: the arm.
        q_start: start (nq,) [rad].
        q_goal: goal (nq,) [rad].
        duration: duration of all baselines but `ruckig` and `controller_default` [s].

    Returns:
        The motion and the duration [s] of each baseline.
    """
    limits, default = arm.active_limits, arm.robot.default_motion
    displacement = q_goal - q_start
    fastest = time_optimal_spline(limits, q_start, q_goal)
    found: dict[BaselineName, tuple[Course, float]] = {
        "trapezoid": (
            _trapezoid(
                q_start,
                displacement,
                duration,
                float(blend_time(limits, displacement, np.asarray(duration))),
            ),
            duration,
        ),
        "quintic": (course_of(quintic_spline(q_start, q_goal, duration)), duration),
        "ruckig": (course_of(fastest), fastest.duration),
        "ruckig_slowed": (course_of(lasting(fastest, duration)), duration),
        "straight": (
            course_of(lasting(straight_spline(limits, q_start, q_goal), duration)),
            duration,
        ),
    }
    if default is not None:
        own, blend = default_times(limits, default, displacement)
        found["controller_default"] = (_trapezoid(q_start, displacement, own, blend), own)
    return found


@dataclass(frozen=True)
class ReportedBaseline:
    """A baseline as reported by an answer: duration [s], energies [J] with the subsequent wait,
    saving [1]; None without a claimed saving.
    """

    name: BaselineName
    duration: float
    electrical: float
    mechanical: float
    saving: float | None


def planned_baselines(
    arm: Arm,
    q_start: Array,
    known: Sequence[Array],
    duration: float,
    reported: Sequence[ReportedBaseline],
) -> list[PlannedBaseline]:
    """The baselines of an answer.

    An answer does not contain the goal configuration of its baselines. The function finds the
    configuration that reproduces the reported durations and energies. It leaves out baselines
    without such a configuration, such as baselines along a tool path, baselines without a saving,
    and baselines of another duration than the answer without a wait.

    Args:
        arm: the arm.
        q_start: start of the answer (nq,) [rad].
        known: goals in the answer (nq,) [rad], its own first.
        duration: duration of the answer [s].
        reported: baselines of the answer.
    """
    by_name = {each.name: each for each in reported}
    if not {"quintic", "ruckig"} <= by_name.keys():
        return []
    fastest, work = by_name["ruckig"].duration, by_name["quintic"].mechanical
    goal = _goal(arm, q_start, _goals(arm, known), duration, fastest, work)
    if goal is None:
        return []
    found, plant = [], Plant(arm)
    for name, (course, own) in courses(arm, q_start, goal, duration).items():
        each = by_name.get(name)
        if each is None or each.saving is None:
            continue
        rest = each.electrical - _electrical(plant, course, own)
        waiting = rest if rest > BASELINES.min_waiting * abs(each.electrical) else 0.0
        if waiting > 0 or abs(own - duration) <= BASELINES.same_duration * duration:
            found.append(PlannedBaseline(name, course, own, each.saving, waiting))
    return found


def _goals(arm: Arm, known: Sequence[Array]) -> Iterator[Array]:
    """Known goals, then all other configurations with the pose of the first one."""
    yield from known
    kinematics = inverse_kinematics_for(arm.robot)
    if kinematics is not None:
        try:
            found = kinematics.solve(tcp_pose(arm, known[0]), arm.T_flange_tcp, arm.active_limits)
        except (UnreachablePose, NoConfigurationFound, SingularPose):
            return
        yield from (each.q for each in found)


def _goal(
    arm: Arm, q_start: Array, goals: Iterable[Array], duration: float, fastest: float, work: float
) -> Array | None:
    """The goal with a given duration and work of two baselines; None if there is none.

    Args:
        arm: the arm.
        q_start: start (nq,) [rad].
        goals: candidates (nq,) [rad].
        duration: duration of the quintic [s].
        fastest: duration of Ruckig's motion [s].
        work: mechanical work of the quintic [J].
    """
    plant = Plant(arm)
    for goal in goals:
        checkpoint()
        if np.array_equal(q_start, goal):
            continue
        ours = time_optimal_spline(arm.active_limits, q_start, goal).duration
        if abs(ours - fastest) > BASELINES.duration_tolerance * fastest:
            continue
        own = plant.energy(quintic_spline(q_start, goal, duration)).mechanical.total
        if abs(own - work) <= BASELINES.work_tolerance * abs(work):
            return goal
    return None


def _electrical(plant: Plant, course: Course, duration: float) -> float:
    """Electrical energy [J] of a motion, by the trapezoidal rule."""
    motion = reference(course, duration, BASELINES.sample_period)
    weights = np.full(len(motion.q), motion.step)
    weights[[0, -1]] /= 2
    gain = plant.potential(motion.q[-1]) - plant.potential(motion.q[0])
    tau = plant.torques(motion.q, motion.v, motion.a)
    return breakdown(weights, motion.v, motion.a, tau, gain, plant.arm).electrical.total


def _trapezoid(q_start: Array, displacement: Array, duration: float, blend: float) -> Course:
    def at(t: Array) -> tuple[Array, Array, Array]:
        s, rate, acceleration = trapezoid_law(t, duration, blend)[:, :, None] * displacement
        return q_start + s, rate, acceleration

    return at
