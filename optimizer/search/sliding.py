"""Ends of a redundant arm that slide along their self-motions during the optimisation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.targets import Side
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sampled_ends import is_on, with_ends
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.solve_context import SolveContext


def may_slide(prepared: PreparedProblem) -> bool:
    """Whether ends at a pose may slide along self-motions.

    The arm must have one joint more than a pose fixes, and the method free control points.
    """
    is_redundant = prepared.arm.robot.nq == POSE_FREEDOMS + 1
    return is_redundant and method_of(prepared.problem).free_control_points


def slides(prepared: PreparedProblem, candidate: Candidate) -> bool:
    """Whether an end of a candidate may slide along a self-motion."""
    return may_slide(prepared) and (
        candidate.start.self_motion is not None or candidate.goal.self_motion is not None
    )


def with_sliding_ends(context: SolveContext, candidate: Candidate) -> SolveContext:
    """The context of a solve with sliding ends; unchanged if none may slide."""
    prepared = context.prepared
    if not slides(prepared, candidate):
        return context
    start, goal = candidate.start.self_motion, candidate.goal.self_motion
    return replace(
        context,
        start_curve=None if start is None else HeldPose.of(prepared.arm, candidate.q_start),
        goal_curve=None if goal is None else HeldPose.of(prepared.arm, candidate.q_goal),
    )


def moved_to(
    prepared: PreparedProblem, candidates: Sequence[Candidate], candidate: Candidate, spline: Spline
) -> Candidate | None:
    """The candidate with the ends of a motion and its bounds; None if the problem forbids these
    ends.

    Args:
        prepared: problem of the motions.
        candidates: all candidates; where curves meet, an end may continue along the next curve.
        candidate: the candidate.
        spline: the motion.
    """
    q_start, q_goal = spline.control_points[[0, -1]]
    start, goal = (
        _end(candidates, candidate, "start", q_start),
        _end(candidates, candidate, "goal", q_goal),
    )
    if start is None or goal is None:
        return None
    return with_ends(prepared, replace(candidate, start=start, goal=goal), q_start, q_goal)


def _end(
    candidates: Sequence[Candidate], candidate: Candidate, side: Side, q: Array
) -> EndConfiguration | None:
    """The end of the same target whose self-motion holds q (nq,) [rad]; None if there is none."""
    own: EndConfiguration = getattr(candidate, side)
    if own.self_motion is None:
        return own
    ends: Iterable[EndConfiguration] = dict.fromkeys(
        end for each in candidates if (end := getattr(each, side)).target == own.target
    )
    nearest: dict[SelfMotion, tuple[float, EndConfiguration]] = {}
    for end in ends:
        if end.self_motion is not None:
            sample = float(np.abs(wrapped(end.q - q)).max()), end
            known = nearest.get(end.self_motion, sample)
            nearest[end.self_motion] = min(known, sample, key=itemgetter(0))
    for _, end in sorted(nearest.values(), key=itemgetter(0)):
        if end.self_motion is not None and is_on(end.self_motion, q):
            return end
    return None
