"""The candidates along a tool path: one for each configuration of its first pose from which the arm can follow it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.robot import Array
from optimizer.exceptions import PathAttempt, PathInfeasible
from optimizer.kinematics.course_tracing import Trace, traces, turned, within
from optimizer.prepared_problem import PreparedProblem
from optimizer.search.candidates import Candidate
from optimizer.search.ends import EndConfiguration, ends, label_of

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
        whole = trace if start.fixed else turned(trace, limits.q_min, limits.q_max, start.choices)
        if trace.obstacle is None and whole is not None and within(whole, limits.q_min, limits.q_max):
            candidate = _candidate(prepared, start, whole)
            if candidate is not None:
                found.append(candidate)
                prepared.traces[whole.q[0].tobytes()] = whole
                continue
        attempts.append(_attempt(prepared, start, trace))
    if not found:
        raise PathInfeasible(course.length, attempts)
    return found


def _candidate(prepared: PreparedProblem, start: EndConfiguration, trace: Trace) -> Candidate | None:
    """The candidate of a whole trace; None if it leads to other joint positions than those given for the goal."""
    q_start, q_goal, given = trace.q[0], trace.q[-1], prepared.problem.goal
    if isinstance(given, np.ndarray):
        if np.abs(q_goal - given).max() > SAME:
            return None
        q_goal = given
    goal = EndConfiguration(
        label_of(prepared.arm.robot, q_goal), q_goal, [[value] for value in q_goal.tolist()], True, start.target
    )
    return Candidate(start, goal, q_start, q_goal)


def _attempt(prepared: PreparedProblem, start: EndConfiguration, trace: Trace) -> PathAttempt:
    """How far the path is followed from a configuration, and what stops it."""
    limits = prepared.arm.active_limits
    shift = _least_turns(trace, start.choices)
    outside = ((trace.q + shift < limits.q_min) | (trace.q + shift > limits.q_max)).any(axis=1)
    if outside.any():
        first = int(outside.argmax())
        return PathAttempt(start.label, first / max(len(trace.q) - 1, 1) * trace.followed, "outside_limits")
    return PathAttempt(start.label, trace.followed, trace.obstacle or "other_goal")


def _least_turns(trace: Trace, choices: Sequence[Sequence[float]]) -> Array:
    """Full turns (nq,) [rad] to the choice of each joint at the start that is nearest to zero."""
    return np.asarray([min(each, key=abs) for each in choices] - trace.q[0])
