"""Joint paths along a course of the TCP, by Newton's method from point to point.

Newton's method at a point starts from the configuration of the previous point. Several
configurations of the first pose are continued at once. A configuration leads along one curve in
joint space, as far as the arm reaches without passing a singularity. The joint path is a quintic
spline through the points of the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics import newton
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.tcp import flange_pose, tcp_pose
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.kinematics.tool_path.turning_grid import (
    TurningGrid,
    shortest,
    turning_of,
    turning_through,
    values_of,
)
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class TraceSettings:
    """Settings of traces."""

    step: float = 0.005
    """Largest distance between points [m]."""
    points_on_piece: int = 32
    """Smallest number of points on a straight piece, and on half of a corner."""
    far: float = 0.03
    """Joint movement between points above which a trace is repeated with more points [rad]."""
    refinement: int = 4
    """Factor of the number of points in the repetition."""
    reached: float = 1e-9
    """Largest pose error of a configuration on the course [m, rad]."""
    jump: float = 0.25
    """Joint movement between points above which the arm passes a singularity [rad]."""
    turning_values: tuple[int, ...] = (10, 18, 34)
    """Numbers of values of a turning; the first number that leads to the end of the course is
    used.
    """
    turn_step: float = 0.1
    """Longest step of a turn of the tool at the start [rad]."""


TRACE = TraceSettings()

Obstacle = Literal["unreachable", "singular"]


@dataclass(frozen=True, eq=False)
class Trace:
    """Configurations q (m, nq) [rad] at the fractions `at` (m,) of a course.

    `obstacle` tells why they end before the end of the course, if they do. `turning` is the turning
    of the tool on the way, if any. With other turnings the course can be followed up to the
    fraction `farthest`.
    """

    q: Array
    at: Array
    obstacle: Obstacle | None = None
    turning: CubicSpline | None = None
    farthest: float = 0.0

    @property
    def followed(self) -> float:
        """Fraction of the course that the arm followed."""
        return max(float(self.at[-1]), self.farthest)

    def reversed(self) -> Trace:
        """A whole trace without a turning, followed from its end to its start."""
        return replace(self, q=self.q[::-1], at=1.0 - self.at[::-1])


@lru_cache(maxsize=16)
def chain_of(robot: Robot) -> Chain:
    """Chain of a robot."""
    return Chain.of(robot.model)


def traces(arm: Arm, course: ToolCourse, q_start: Array) -> list[Trace]:
    """Traces of a course from the configurations q_start (n, nq) [rad] of its first pose.

    If the tool may turn about an axis, it turns only if the arm cannot follow the course otherwise.
    From a free start the tool turns uniformly to the end, or not at all if the end is free, too.
    """
    if course.free_start and course.turning is None:
        return _evenly_turned(arm, course, q_start)
    return _turned_where_needed(arm, [course], _traces(arm, [course], q_start))


def traces_of_each(arm: Arm, courses: Sequence[ToolCourse], q_start: Array) -> list[Trace]:
    """Traces of n courses with fixed ends, course k from configuration k of q_start (n, nq) [rad].

    Courses of one shape, up to turns about the path's free axis, are traced together.
    """
    found, left = dict[int, Trace](), list(range(len(courses)))
    while left:
        first = courses[left[0]]
        own = [k for k in left if courses[k] is first or courses[k].has_shape_of(first)]
        some = [courses[k] for k in own]
        found |= zip(
            own, _turned_where_needed(arm, some, _traces(arm, some, q_start[own])), strict=True
        )
        left = [k for k in left if k not in found]
    return [found[k] for k in range(len(courses))]


def _turned_where_needed(
    arm: Arm, courses: Sequence[ToolCourse], found: Sequence[Trace]
) -> list[Trace]:
    """Traces with a turning of the tool if it is allowed and needed.

    Args:
        arm: the arm.
        courses: the course of all traces, or one course per trace.
        found: the traces without a turning.
    """
    own = list(courses) * len(found) if len(courses) == 1 else courses
    return [
        with_turning(arm, course, each)
        if each.obstacle and course.path.about and course.turning is None
        else each
        for course, each in zip(own, found, strict=True)
    ]


def _evenly_turned(arm: Arm, course: ToolCourse, q_start: Array) -> list[Trace]:
    turned = np.array([_angle_at(arm, course, q) for q in q_start])
    free = course.free_end, course.free_start
    angles = np.linspace(turned, turned * course.free_end, TRACE.turning_values[0], axis=1)
    courses = [
        replace(course, turning=turning_of(values_of(each, *free), *free)) for each in angles
    ]
    found = zip(courses, _traces(arm, courses, q_start), strict=True)
    return [replace(trace, turning=own.turning) for own, trace in found]


def _angle_at(arm: Arm, course: ToolCourse, q_start: Array) -> float:
    """Turning angle [rad] of the tool at the start of a course in a configuration q_start (nq,)
    [rad].
    """
    return course.angle_at_start(tcp_pose(arm, q_start)) if course.free_start else 0.0


def turned_start(
    arm: Arm, course: ToolCourse, q_start: Array, before: float, after: float
) -> Array | None:
    """Configuration after a turn of the tool at the start of a course.

    Args:
        arm: arm with its TCP.
        course: course of the tool path.
        q_start: configuration at the angle `before`, shape (nq,) [rad].
        before: turning angle before [rad].
        after: turning angle after [rad].

    Returns:
        The configuration (nq,) [rad]; None if the arm cannot turn so far.
    """
    chain, q = chain_of(arm.robot), q_start
    (T,) = replace(course, turning=None).poses(np.zeros(1))
    angles = np.linspace(before, after, int(np.ceil(abs(after - before) / TRACE.turn_step)) + 1)[1:]
    for pose in flange_pose(
        course.turned(np.tile(T, (len(angles), 1, 1)), angles), arm.T_flange_tcp
    ):
        (found,), (residual,) = newton.solved(chain, q[None], pose)
        if residual > TRACE.reached or np.abs(found - q).max() > TRACE.jump:
            return None
        q = found
    return q


def with_turning(arm: Arm, course: ToolCourse, stopped: Trace) -> Trace:
    """Trace to the end of the course with a turning of the tool, in place of a `stopped` trace.

    If no turning leads to the end, the result is the stopped trace with the fraction `farthest`.
    """
    angle = _angle_at(arm, course, stopped.q[0])
    grid = TurningGrid.of(arm, chain_of(arm.robot), course, stopped.q[0], turned=angle)
    chosen = grid.least(shortest, course.free_end, course.free_start)
    for knots in TRACE.turning_values if chosen is not None else ():
        turning = turning_through(
            grid.at, grid.angles[chosen], knots, course.free_end, course.free_start
        )
        q_start = turned_start(arm, course, stopped.q[0], angle, float(turning(0.0)))
        if q_start is None:
            continue
        (trace,) = _traces(arm, [replace(course, turning=turning)], q_start[None])
        if trace.obstacle is None:
            return replace(trace, turning=turning)
    return replace(stopped, farthest=grid.reached if chosen is None else 0.0)


def _traces(arm: Arm, courses: Sequence[ToolCourse], q_start: Array) -> list[Trace]:
    """Traces from n starts, of one common course or of n courses of the same shape.

    If joints move far between points of a trace, it is repeated with more points.
    """
    found = _traced(arm, courses, q_start, courses[0].grid(TRACE.points_on_piece, TRACE.step))
    coarse = [
        k
        for k, each in enumerate(found)
        if len(each.q) > 1 and np.abs(np.diff(each.q, axis=0)).max() > TRACE.far
    ]
    if coarse:
        own = courses if len(courses) == 1 else [courses[k] for k in coarse]
        finer = _traced(
            arm,
            own,
            q_start[coarse],
            courses[0].grid(
                TRACE.refinement * TRACE.points_on_piece, TRACE.step / TRACE.refinement
            ),
        )
        found = [finer[coarse.index(k)] if k in coarse else each for k, each in enumerate(found)]
    return found


def _traced(arm: Arm, courses: Sequence[ToolCourse], q_start: Array, at: Array) -> list[Trace]:
    poses, chain = np.stack([course.poses(at) for course in courses]), chain_of(arm.robot)
    q = np.full((len(q_start), len(at), q_start.shape[1]), np.nan)
    q[:, 0] = q_start
    last, obstacle = np.zeros(len(q_start), dtype=int), list[Obstacle | None]([None] * len(q_start))
    active = np.arange(len(q_start))
    for k in range(1, len(at)):
        checkpoint()
        guess = before = q[active, k - 1]
        if k > 1:
            guess = before + (before - q[active, k - 2]) * (
                (at[k] - at[k - 1]) / (at[k - 1] - at[k - 2])
            )
        pose = poses[0, k] if len(courses) == 1 else poses[active, k]
        found, residual = newton.solved(chain, guess, flange_pose(pose, arm.T_flange_tcp))
        jumped = np.abs(found - before).max(axis=1) > TRACE.jump
        for node, is_missed, is_jump in zip(active, residual > TRACE.reached, jumped, strict=True):
            if is_missed or is_jump:
                obstacle[node] = "unreachable" if is_missed else "singular"
        kept = ~(jumped | (residual > TRACE.reached))
        active = active[kept]
        if not len(active):
            break
        q[active, k], last[active] = found[kept], k
    return [Trace(q[n, : last[n] + 1], at[: last[n] + 1], obstacle[n]) for n in range(len(q_start))]


def within(trace: Trace, lower: Array, upper: Array) -> bool:
    """Whether a trace stays within joint limits (nq,) [rad]."""
    return bool(((trace.q >= lower) & (trace.q <= upper)).all())


def turned(
    trace: Trace, lower: Array, upper: Array, choices: Sequence[Sequence[float]]
) -> Trace | None:
    """The trace, shifted by full turns into joint limits, nearest to their middle.

    Args:
        trace: trace of a course.
        lower: lower limits, shape (nq,) [rad].
        upper: upper limits, shape (nq,) [rad].
        choices: possible positions of the joints at the start of the trace [rad].

    Returns:
        The shifted trace; None if no full turns fit.
    """
    shift = np.zeros(len(lower))
    for joint, positions in enumerate(choices):
        course, found = trace.q[:, joint], list[tuple[float, float]]()
        for position in positions:
            offset = position - course[0]
            low, high = course.min() + offset, course.max() + offset
            if lower[joint] <= low and high <= upper[joint]:
                found.append((abs((low + high) - (lower[joint] + upper[joint])), offset))
        if not found:
            return None
        shift[joint] = min(found)[1]
    return replace(trace, q=trace.q + shift)
