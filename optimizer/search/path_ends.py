"""The candidates along a tool path: one for each configuration of its first pose from which the arm can follow it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.robot import Array, Limits
from optimizer.deadline import Deadline
from optimizer.exceptions import PathAttempt, PathInfeasible
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.course_tracing import Trace, traces, turned, within
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.problem.targets import Target
from optimizer.search.candidates import Candidate, bound, pairs
from optimizer.search.ends import EndConfiguration, ends, label_of
from optimizer.search.free_goal_bound import family_bound_of
from optimizer.search.missed_branches import bound_of_others

# rad: where a path leads, and joint positions that are given for its end
SAME = 1e-6


def path_candidates(prepared: PreparedProblem) -> list[Candidate]:
    """A candidate for each start configuration from which the arm follows the tool path to its end.

    Raises PathInfeasible with how far each one gets; the errors of `ends`.
    """
    course, limits = prepared.course, prepared.arm.active_limits
    assert course is not None
    starts, _ = ends(prepared, "start")
    found, attempts = list[Candidate](), list[PathAttempt]()
    for start, trace in zip(starts, traces(prepared.arm, course, np.array([each.q for each in starts])), strict=True):
        choices = _choices(start, trace, prepared.problem.goal)
        whole = trace if start.fixed else turned(trace, limits.q_min, limits.q_max, choices)
        if trace.obstacle is None and whole is not None and within(whole, limits.q_min, limits.q_max):
            candidate = _candidate(prepared, start, whole)
            if candidate is not None:
                found.append(candidate)
                prepared.traces[whole.q[0].tobytes()] = whole
                continue
        attempts.append(attempt_of(limits, start, trace))
    if not found:
        raise PathInfeasible(course.length, attempts)
    return found


def bound_beside(prepared: PreparedProblem, followed: Sequence[Candidate], deadline: Deadline, enough: float) -> float:
    """Lower bound [J] on motions along the tool path to which none of the `followed` candidates leads.

    A path may come so near to a singularity that a motion within its tolerance goes on in another branch than the one
    that was followed; and of a self-motion at its start only samples were followed. So this is the bound of all motions
    between the first pose and the last one, in any other configurations; and where the goal leaves a rotation free, of
    all of them: that of these ends once it reaches `enough` [J].
    """
    free = PreparedProblem.of(replace(prepared.problem, tool_path=None))
    starts, _ = ends(free, "start")
    if isinstance(prepared.problem.goal, ConeOrientedPose):
        goal = followed[0].goal
        anywhere = [Candidate(start, goal, start.q, goal.q) for start in starts]
        return min(family_bound_of(free, anywhere, deadline, enough), bound_of_others(free, anywhere, deadline))
    candidates = pairs(free, starts, ends(free, "goal")[0])
    bound(free, candidates)
    others = (each.lower_bound for each in candidates if not each.sampled and not _is_among(each, followed))
    return min([bound_of_others(free, candidates, deadline), *others])


def _is_among(pair: Candidate, followed: Sequence[Candidate]) -> bool:
    """Whether a pair of ends is one of those that were followed, but for common full turns."""
    return any(
        np.abs(wrapped(pair.q_start - each.q_start)).max() < SAME
        and np.abs((pair.q_goal - pair.q_start) - (each.q_goal - each.q_start)).max() < SAME
        for each in followed
    )


def _candidate(prepared: PreparedProblem, start: EndConfiguration, trace: Trace) -> Candidate | None:
    """The candidate of a whole trace; None if it leads to other joint positions than those given for the goal."""
    q_start, q_goal, given = trace.q[0], trace.q[-1], prepared.problem.goal
    if isinstance(given, np.ndarray):
        if np.abs(q_goal - given).max() > SAME:
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
    return Candidate(start, goal, q_start, q_goal)


def _choices(start: EndConfiguration, trace: Trace, goal: Target) -> list[list[float]]:
    """The positions of each joint at the start: those from which it comes to the given one of the goal, if any does."""
    if not isinstance(goal, np.ndarray):
        return start.choices
    needed = goal - (trace.q[-1] - trace.q[0])
    reaching = [[x for x in each if abs(x - q) < SAME] for each, q in zip(start.choices, needed, strict=True)]
    return [some or each for some, each in zip(reaching, start.choices, strict=True)]


def attempt_of(limits: Limits, start: EndConfiguration, trace: Trace) -> PathAttempt:
    """How far a path is followed from a configuration within `limits`, and what stops it."""
    shift = _least_turns(trace, start.choices)
    outside = ((trace.q + shift < limits.q_min) | (trace.q + shift > limits.q_max)).any(axis=1)
    if outside.any():
        first = int(outside.argmax())
        return PathAttempt(start.label, float(trace.at[first]), "outside_limits")
    return PathAttempt(start.label, trace.followed, trace.obstacle or "other_goal")


def _least_turns(trace: Trace, choices: Sequence[Sequence[float]]) -> Array:
    """Full turns (nq,) [rad] to the choice of each joint at the start that is nearest to zero."""
    return np.asarray([min(each, key=abs) for each in choices] - trace.q[0])
