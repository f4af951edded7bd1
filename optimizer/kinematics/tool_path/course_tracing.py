"""From the course of the TCP to that of the joints: inverse kinematics by Newton's method, each
point from the last.

Several configurations of the first pose are followed at once. Each leads along one curve in joint
space, as far as the arm reaches and no singularity stops it. The joint path is a quintic spline
through what was found.
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
from joulepath.optimizer.kinematics.tool_path.turning_sheet import (
    TurningSheet,
    shortest,
    turning_of,
    turning_through,
    values_of,
)
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm

# longest way [m] from point to point, and how many there are at least on a straight piece and on
# half of a corner
STEP, ON_PIECE = 0.005, 32
# joints that move farther from point to point [rad] are followed in so many times as many steps
FAR, FINER = 0.03, 4
# a configuration is on the course if it misses the pose by less [m, rad]
REACHED = 1e-9
# a joint that turns farther from one point to the next [rad] does so at a singularity
JUMP = 0.25
# knot spans of the joint path on each piece of the course at first, and at most in all; traced
# points in each of them at least; and the share of the tolerances that the fit may take
FIRST_SPANS, MOST_SPANS, SAMPLES_IN_SPAN, SHARE = 2, 500, 2, 0.5

# values by which a turning is given: the first that leads to the end of the course counts
KNOTS = (10, 18, 34)
# longest step [rad] of a turn of the tool at the start
TURN_STEP = 0.1

Obstacle = Literal["unreachable", "singular"]


@dataclass(frozen=True, eq=False)
class Trace:
    """Configurations q (m, nq) [rad] at the fractions `at` (m,) of a course, and why they end
    before its end, if so.

    The tool is turned on the way by `turning`, if it is. With other turnings the course is followed
    to `farthest`.
    """

    q: Array
    at: Array
    obstacle: Obstacle | None = None
    turning: CubicSpline | None = None
    farthest: float = 0.0

    @property
    def followed(self) -> float:
        """The share of the course that was followed."""
        return max(float(self.at[-1]), self.farthest)


@lru_cache(maxsize=16)
def chain_of(robot: Robot) -> Chain:
    """The chain of a robot."""
    return Chain.of(robot.model)


def traces(arm: Arm, course: ToolCourse, q_start: Array) -> list[Trace]:
    """The course followed from each configuration q_start (n, nq) [rad] of its first pose.

    Where the tool may turn about an axis, it does so where the course cannot be followed without.
    From a free start it turns evenly to the end, or not at all if that is free, too.
    """
    if course.free_start and course.turning is None:
        return _evenly_turned(arm, course, q_start)
    return _turned_where_needed(arm, [course], _traces(arm, [course], q_start))


def traces_of_each(arm: Arm, courses: Sequence[ToolCourse], q_start: Array) -> list[Trace]:
    """`traces` of courses whose ends are given in full, each from its own configuration q_start (n,
    nq) [rad].

    Courses of one shape, which may be turned about the path's free axis, are followed together.
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
    """What was found of one course or of one each, with a turning where that is allowed and nothing
    else leads on.
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
    angles = np.linspace(turned, turned * course.free_end, KNOTS[0], axis=1)
    courses = [
        replace(course, turning=turning_of(values_of(each, *free), *free)) for each in angles
    ]
    found = zip(courses, _traces(arm, courses, q_start), strict=True)
    return [replace(trace, turning=own.turning) for own, trace in found]


def _angle_at(arm: Arm, course: ToolCourse, q_start: Array) -> float:
    """The angle [rad] by which the tool is turned at the start of a course in a configuration
    q_start (nq,) [rad].
    """
    return course.angle_at_start(tcp_pose(arm, q_start)) if course.free_start else 0.0


def turned_start(
    arm: Arm, course: ToolCourse, q_start: Array, before: float, after: float
) -> Array | None:
    """The configuration (nq,) [rad] to which the arm turns the tool at the start of a course, from
    q_start (nq,) at one angle [rad] to another one; None if it cannot."""
    chain, q = chain_of(arm.robot), q_start
    (T,) = replace(course, turning=None).poses(np.zeros(1))
    angles = np.linspace(before, after, int(np.ceil(abs(after - before) / TURN_STEP)) + 1)[1:]
    for pose in flange_pose(
        course.turned(np.tile(T, (len(angles), 1, 1)), angles), arm.T_flange_tcp
    ):
        (found,), (missed,) = newton.solved(chain, q[None], pose)
        if missed > REACHED or np.abs(found - q).max() > JUMP:
            return None
        q = found
    return q


def with_turning(arm: Arm, course: ToolCourse, stopped: Trace) -> Trace:
    """The trace of a turning with which the course is followed to its end, where another one is
    `stopped` on the way.

    If there is none: how far the course is followed.
    """
    angle = _angle_at(arm, course, stopped.q[0])
    sheet = TurningSheet.of(arm, chain_of(arm.robot), course, stopped.q[0], turned=angle)
    chosen = sheet.least(shortest, course.free_end, course.free_start)
    for knots in KNOTS if chosen is not None else ():
        turning = turning_through(
            sheet.at, sheet.angles[chosen], knots, course.free_end, course.free_start
        )
        q_start = turned_start(arm, course, stopped.q[0], angle, float(turning(0.0)))
        if q_start is None:
            continue
        (trace,) = _traces(arm, [replace(course, turning=turning)], q_start[None])
        if trace.obstacle is None:
            return replace(trace, turning=turning)
    return replace(stopped, farthest=sheet.reached if chosen is None else 0.0)


def _traces(arm: Arm, courses: Sequence[ToolCourse], q_start: Array) -> list[Trace]:
    """A course with its turning, if any, followed from each start: one for all, or one each, of the
    same shape.

    Where joints move far from point to point, it is followed once more with more points.
    """
    found = _traced(arm, courses, q_start, courses[0].grid(ON_PIECE, STEP))
    coarse = [
        k
        for k, each in enumerate(found)
        if len(each.q) > 1 and np.abs(np.diff(each.q, axis=0)).max() > FAR
    ]
    if coarse:
        own = courses if len(courses) == 1 else [courses[k] for k in coarse]
        finer = _traced(arm, own, q_start[coarse], courses[0].grid(FINER * ON_PIECE, STEP / FINER))
        found = [finer[coarse.index(k)] if k in coarse else each for k, each in enumerate(found)]
    return found


def _traced(arm: Arm, courses: Sequence[ToolCourse], q_start: Array, at: Array) -> list[Trace]:
    poses, chain = np.stack([course.poses(at) for course in courses]), chain_of(arm.robot)
    q = np.full((len(q_start), len(at), q_start.shape[1]), np.nan)
    q[:, 0] = q_start
    last, obstacle = np.zeros(len(q_start), dtype=int), list[Obstacle | None]([None] * len(q_start))
    going = np.arange(len(q_start))
    for k in range(1, len(at)):
        checkpoint()
        guess = before = q[going, k - 1]
        if k > 1:
            guess = before + (before - q[going, k - 2]) * (
                (at[k] - at[k - 1]) / (at[k - 1] - at[k - 2])
            )
        pose = poses[0, k] if len(courses) == 1 else poses[going, k]
        found, missed = newton.solved(chain, guess, flange_pose(pose, arm.T_flange_tcp))
        jumped = np.abs(found - before).max(axis=1) > JUMP
        for node, is_missed, is_jump in zip(going, missed > REACHED, jumped, strict=True):
            if is_missed or is_jump:
                obstacle[node] = "unreachable" if is_missed else "singular"
        kept = ~(jumped | (missed > REACHED))
        going = going[kept]
        if not len(going):
            break
        q[going, k], last[going] = found[kept], k
    return [Trace(q[n, : last[n] + 1], at[: last[n] + 1], obstacle[n]) for n in range(len(q_start))]


def joint_path(arm: Arm, course: ToolCourse, trace: Trace) -> Spline | None:
    """The path γ(s), s ∈ [0, 1], through a whole trace; None if it turns too sharply for the
    tolerances.

    The spline has more knots where it is off the course: near corners and singularities.
    """
    course = replace(course, turning=trace.turning)
    breaks = course.grid(FIRST_SPANS)
    while len(breaks) <= MOST_SPANS:
        checkpoint()
        denser = _denser(arm, course, trace, breaks)
        if denser is None:
            return None
        trace = denser
        knots = bspline.clamped(breaks)
        path = Spline(bspline.DEGREE, knots, bspline.fit(trace.q, trace.at, knots, resting=1))
        checked = np.sort(np.concatenate([trace.at, (trace.at[1:] + trace.at[:-1]) / 2]))
        off = course.ratios(tcp_pose(arm, path.curve(checked)), course.poses(checked))
        bad = np.unique(
            np.searchsorted(breaks, checked[off > SHARE], side="right").clip(1, len(breaks) - 1)
        )
        if not len(bad):
            return path
        breaks = np.union1d(breaks, (breaks[bad] + breaks[bad - 1]) / 2)
    return None


def _denser(arm: Arm, course: ToolCourse, trace: Trace, breaks: Array) -> Trace | None:
    """A trace with enough points for a spline with these breaks; None if one of them is not
    found."""
    few = np.flatnonzero(np.histogram(trace.at, breaks)[0] < SAMPLES_IN_SPAN)
    inside = (np.arange(SAMPLES_IN_SPAN) + 0.5) / SAMPLES_IN_SPAN
    at = (breaks[few, None] + inside * np.diff(breaks)[few, None]).ravel()
    chain, found = chain_of(arm.robot), np.empty((len(at), trace.q.shape[1]))
    guesses = np.stack([np.interp(at, trace.at, q) for q in trace.q.T], axis=1)
    for k, pose in enumerate(course.poses(at)):
        (found[k],), (missed,) = newton.solved(
            chain, guesses[k][None], flange_pose(pose, arm.T_flange_tcp)
        )
        if missed > REACHED or np.abs(found[k] - guesses[k]).max() > JUMP:
            return None
    order = np.argsort(np.concatenate([trace.at, at]), kind="stable")
    return replace(
        trace, q=np.concatenate([trace.q, found])[order], at=np.concatenate([trace.at, at])[order]
    )


def path_ratios(arm: Arm, course: ToolCourse, q: Array) -> dict[str, float]:
    """The worst deviations of configurations q (k, nq) [rad] from a course, over their
    tolerances."""
    position, rotation = course.deviation(tcp_pose(arm, q))
    return {
        "path_position": float(position.max()) / course.path.position_tolerance,
        "path_rotation": float(rotation.max()) / course.path.rotation_tolerance,
    }


def within(trace: Trace, lower: Array, upper: Array) -> bool:
    """Whether a trace keeps within joint limits (nq,) [rad]."""
    return bool(((trace.q >= lower) & (trace.q <= upper)).all())


def turned(
    trace: Trace, lower: Array, upper: Array, choices: Sequence[Sequence[float]]
) -> Trace | None:
    """The trace by full turns of its joints within joint limits (nq,) [rad], nearest to their
    middle.

    `choices` are the positions of each joint at its start. None if no full turns are.
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
