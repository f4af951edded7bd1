"""Candidates along a tool path: one per start configuration with a complete trace of the path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.free_ends_bound import bound_between_free_ends, reversed_problem
from joulepath.optimizer.bounds.free_goal_bound import bound_of_free_goals
from joulepath.optimizer.bounds.missed_branches import bound_of_missed_branches
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tool_path.course_tracing import (
    Trace,
    traces,
    turned,
    with_turning,
    within,
)
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.search.candidates import Candidate, bound, pairs
from joulepath.optimizer.search.ends import SAMPLING, ends, ends_of, label_of
from joulepath.optimizer.search.errors import PathAttempt, PathInfeasible


@dataclass(frozen=True)
class PathEndSettings:
    """Settings of the ends of tool paths."""

    equal_distance: float = 1e-6
    """Displacement [rad] below which the end of a path is at given joint positions."""


PATH_ENDS = PathEndSettings()


def path_candidates(
    prepared: PreparedProblem, starts: Sequence[EndConfiguration] | None = None
) -> list[Candidate]:
    """Trace the tool path from start configurations, and build a candidate of each full trace.

    Args:
        prepared: problem with a tool path.
        starts: start configurations; None for samples of the start.

    Raises:
        PathInfeasible: no configuration follows the path to its end.
    """
    course, limits = prepared.course, prepared.arm.active_limits
    assert course is not None
    if starts is None:
        is_redundant = prepared.arm.robot.nq > POSE_FREEDOMS
        counts = SAMPLING.redundant_path_start if is_redundant else SAMPLING.path_start
        starts, _ = ends_of(prepared, "start", prepared.problem.start, counts)
    found, attempts = list[Candidate](), list[PathAttempt]()
    for start, trace in zip(starts, _traces(prepared, starts), strict=True):
        choices = _choices(start, trace, prepared.problem.goal)
        whole = trace if start.fixed else turned(trace, limits.q_min, limits.q_max, choices)
        if (
            trace.obstacle is None
            and whole is not None
            and within(whole, limits.q_min, limits.q_max)
        ):
            candidate = _candidate(prepared, start, whole)
            if candidate is not None:
                found.append(candidate)
                prepared.followed.keep(whole)
                continue
        attempts.append(attempt_of(limits, start, trace))
    if not found:
        raise PathInfeasible(course.length, attempts, joints=prepared.arm.robot.nq)
    return found


def _traces(prepared: PreparedProblem, starts: Sequence[EndConfiguration]) -> list[Trace]:
    """Trace the tool path from the start configurations.

    With a free start, the tool turns at an even rate. If no start angle of a branch leads to the
    end this way, an uneven course of the rotation is computed from one angle.
    """
    course, arm = prepared.course, prepared.arm
    assert course is not None
    known = [prepared.followed.known_trace(each.q) for each in starts]
    found = [each for each in known if each is not None]
    if len(found) < len(starts):
        found = traces(arm, course, np.array([each.q for each in starts]))
    if not course.free_start:
        return found
    followed = {
        start.label for start, trace in zip(starts, found, strict=True) if trace.obstacle is None
    }
    for k, start in enumerate(starts):
        if start.label not in followed:
            followed.add(start.label)
            found[k] = with_turning(arm, course, found[k])
    return found


def bound_beside(
    prepared: PreparedProblem, followed: Sequence[Candidate], deadline: Deadline, enough: float
) -> float:
    """Lower bound [J] on motions along the tool path with other ends than the candidates.

    The bound covers all motions between the first and the last pose in other configurations, for
    two reasons: close to a singularity, a motion within the tolerance of the path may continue in
    another branch, and only samples of a self-motion at the start were followed. With a free
    rotation at an end, the bound covers all configurations of both ends.

    Args:
        prepared: problem of the motions.
        followed: candidates along the path.
        deadline: end of the search for the bound.
        enough: sufficient bound for ends with a free rotation [J].
    """
    start, goal = prepared.problem.start, prepared.problem.goal
    if isinstance(start, ConeOrientedPose) and isinstance(goal, ConeOrientedPose):
        both_free = prepared.beside(prepared.freed(start=followed[0].q_start))
        return bound_between_free_ends(both_free, start, goal, deadline, enough)
    if isinstance(start, ConeOrientedPose):
        return _bound_to_free(
            reversed_problem(prepared.freed(goal, start), goal, start),
            followed[0].start,
            deadline,
            enough,
        )
    problem = prepared.freed()
    if isinstance(goal, ConeOrientedPose):
        return _bound_to_free(problem, followed[0].goal, deadline, enough)
    free = prepared.beside(problem)
    starts, _ = ends(free, "start")
    candidates = pairs(free, starts, ends(free, "goal")[0])
    bound(free, candidates)
    others = (
        each.lower_bound
        for each in candidates
        if not each.sampled and not _is_among(each, followed)
    )
    return min([bound_of_missed_branches(free, candidates, deadline), *others])


def _bound_to_free(
    problem: Problem, goal: EndConfiguration, deadline: Deadline, enough: float
) -> float:
    """Lower bound [J] on motions to any configuration of a partly free goal.

    Args:
        problem: the problem without its tool path.
        goal: any configuration of the goal.
        deadline: end of the search for the bound.
        enough: sufficient bound [J].
    """
    prepared = PreparedProblem.of(problem)
    anywhere = [Candidate(start, goal, start.q, goal.q) for start in ends(prepared, "start")[0]]
    return min(
        bound_of_free_goals(prepared, anywhere, deadline, enough),
        bound_of_missed_branches(prepared, anywhere, deadline),
    )


def _is_among(pair: Candidate, followed: Sequence[Candidate]) -> bool:
    """Whether a pair has the ends of a followed candidate, but for common full turns."""
    return any(
        np.abs(wrapped(pair.q_start - each.q_start)).max() < PATH_ENDS.equal_distance
        and np.abs((pair.q_goal - pair.q_start) - (each.q_goal - each.q_start)).max()
        < PATH_ENDS.equal_distance
        for each in followed
    )


def _candidate(
    prepared: PreparedProblem, start: EndConfiguration, trace: Trace
) -> Candidate | None:
    """The candidate of a whole trace; None if it leads to other joint positions than the goal's."""
    q_start, q_goal, given = trace.q[0], trace.q[-1], prepared.problem.goal
    if isinstance(given, np.ndarray):
        if np.abs(q_goal - given).max() > PATH_ENDS.equal_distance:
            return None
        q_goal = given
    goal = EndConfiguration(
        label_of(prepared.arm.robot, q_goal),
        q_goal,
        [[value] for value in q_goal.tolist()],
        True,
        start.target,
        given if isinstance(given, ConeOrientedPose) else None,
    )
    candidate = Candidate(start, goal, q_start, q_goal)
    if start.tolerance is not None:
        candidate.defer()
    return candidate


def _choices(start: EndConfiguration, trace: Trace, goal: Target) -> list[list[float]]:
    """Start positions by joint consistent with a given goal; all positions if none is."""
    if not isinstance(goal, np.ndarray):
        return start.choices
    needed = goal - (trace.q[-1] - trace.q[0])
    reaching = [
        [x for x in each if abs(x - q) < PATH_ENDS.equal_distance]
        for each, q in zip(start.choices, needed, strict=True)
    ]
    return [some or each for some, each in zip(reaching, start.choices, strict=True)]


def attempt_of(limits: Limits, start: EndConfiguration, trace: Trace) -> PathAttempt:
    """How far a path is followed from a configuration, and the reason why it ends."""
    shift = _least_turns(trace, start.choices)
    outside = ((trace.q + shift < limits.q_min) | (trace.q + shift > limits.q_max)).any(axis=1)
    if outside.any():
        first = int(outside.argmax())
        return PathAttempt(start.label, float(trace.at[first]), "outside_limits")
    return PathAttempt(start.label, trace.followed, trace.obstacle or "other_goal")


def _least_turns(trace: Trace, choices: Sequence[Sequence[float]]) -> Array:
    """Full turns (nq,) [rad] from the trace to the start positions nearest to zero."""
    return np.asarray([min(each, key=abs) for each in choices] - trace.q[0])
