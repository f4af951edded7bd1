"""The motions of an answer's baselines as functions of time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import SingularPose, UnreachablePose
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
from joulepath.optimizer.result.solution import BaselineName

# relative differences of a reported duration, which is exact, and of a mechanical work, which two
# quadratures give
SAME_DURATION, SAME_WORK = 1e-6, 1e-3
# least part of a baseline's energy that is drawn while waiting; less is the error of a quadrature
LEAST_WAITING = 1e-3
# period [s] of the samples by which the energy of a baseline is computed
FINE = 1e-3


def courses(
    arm: Arm, q_start: Array, q_goal: Array, duration: float
) -> dict[BaselineName, tuple[Course, float]]:
    """The baselines from q_start to q_goal (nq,) [rad], each with its duration [s]; see
    `search.baselines`.

    All but `ruckig` and `controller_default` take `duration` [s].
    """
    limits, default = arm.active_limits, arm.robot.default_motion
    way = q_goal - q_start
    fastest = time_optimal_spline(limits, q_start, q_goal)
    found: dict[BaselineName, tuple[Course, float]] = {
        "trapezoid": (
            _trapezoid(
                q_start, way, duration, float(blend_time(limits, way, np.asarray(duration)))
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
        own, blend = default_times(limits, default, way)
        found["controller_default"] = (_trapezoid(q_start, way, own, blend), own)
    return found


@dataclass(frozen=True)
class ReportedBaseline:
    """A baseline as an answer reports it: duration [s], energies [J] with the wait after it, and
    saving [1]; None where none is claimed.
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
    """The baselines of an answer that starts at q_start (nq,) [rad] and takes `duration` [s].

    An answer does not tell to which goal configuration its baselines go: the one that gives the
    durations and energies it reports. `known` (nq,) [rad] are goals that it names, the first is its
    own. What cannot be found is left out, as baselines along a tool path are, and so is what has no
    saving, or takes another time than the answer and does not wait.
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
        waiting = rest if rest > LEAST_WAITING * abs(each.electrical) else 0.0
        if waiting > 0 or abs(own - duration) <= SAME_DURATION * duration:
            found.append(PlannedBaseline(name, course, own, each.saving, waiting))
    return found


def _goals(arm: Arm, known: Sequence[Array]) -> Iterator[Array]:
    """Goal configurations that are known, then every one that reaches the pose of the first."""
    yield from known
    kinematics = inverse_kinematics_for(arm.robot)
    if kinematics is not None:
        try:
            found = kinematics.solve(tcp_pose(arm, known[0]), arm.T_flange_tcp, arm.active_limits)
        except (UnreachablePose, SingularPose):
            return
        yield from (each.q for each in found)


def _goal(
    arm: Arm, q_start: Array, goals: Iterable[Array], duration: float, fastest: float, work: float
) -> Array | None:
    """The goal to which Ruckig's motion takes `fastest` [s] and the quintic of `duration` [s] does
    `work` [J].
    """
    plant = Plant(arm)
    for goal in goals:
        checkpoint()
        if np.array_equal(q_start, goal):
            continue
        ours = time_optimal_spline(arm.active_limits, q_start, goal).duration
        if abs(ours - fastest) > SAME_DURATION * fastest:
            continue
        own = plant.energy(quintic_spline(q_start, goal, duration)).mechanical.total
        if abs(own - work) <= SAME_WORK * abs(work):
            return goal
    return None


def _electrical(plant: Plant, course: Course, duration: float) -> float:
    """Electrical energy [J] of a motion, by the trapezoidal rule."""
    motion = reference(course, duration, FINE)
    weights = np.full(len(motion.q), motion.step)
    weights[[0, -1]] /= 2
    gain = plant.potential(motion.q[-1]) - plant.potential(motion.q[0])
    tau = plant.torques(motion.q, motion.v, motion.a)
    return breakdown(weights, motion.v, motion.a, tau, gain, plant.arm).electrical.total


def _trapezoid(q_start: Array, way: Array, duration: float, blend: float) -> Course:
    def at(t: Array) -> tuple[Array, Array, Array]:
        s, rate, acceleration = trapezoid_law(t, duration, blend)[:, :, None] * way
        return q_start + s, rate, acceleration

    return at
