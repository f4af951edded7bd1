"""Ends of a redundant arm that slide along their self-motions while the motion between them is
optimised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.tool_path.held_pose import HeldPose
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.targets import Side
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sampled_ends import with_ends
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.solve_context import SolveContext

# joints that a pose fixes
FIXED = 6
# a posture farther from a curve is not on it [rad]
ON_CURVE = 1e-6


def slides(prepared: PreparedProblem, candidate: Candidate) -> bool:
    """Whether an end of the candidate may slide: on a self-motion of an arm with one joint more
    than a pose fixes.
    """
    able = prepared.arm.robot.nq == FIXED + 1 and method_of(prepared.problem).free_control_points
    return able and (
        candidate.start.self_motion is not None or candidate.goal.self_motion is not None
    )


def with_sliding_ends(context: SolveContext, candidate: Candidate) -> SolveContext:
    """The context of a solve whose ends slide along their self-motions; unchanged if none may."""
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
    """The candidate with the ends of a motion, and its bounds; None if the problem does not allow
    these ends.

    `candidates` are all of the problem: where curves meet, an end may go on along the next one.
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
    """The end of the same target on whose self-motion q (nq,) is; None if it is on none that the
    problem allows.
    """
    own: EndConfiguration = getattr(candidate, side)
    if own.self_motion is None:
        return own
    ends = {
        id(end): end for each in candidates if (end := getattr(each, side)).target == own.target
    }
    nearest: dict[int, tuple[float, EndConfiguration]] = {}
    for end in ends.values():
        if end.self_motion is not None:
            known, sample = id(end.self_motion), (float(np.abs(wrapped(end.q - q)).max()), end)
            nearest[known] = min(nearest.get(known, sample), sample, key=itemgetter(0))
    for _, end in sorted(nearest.values(), key=itemgetter(0)):
        motion = end.self_motion
        # on a joint's limit the member may be beyond it by rounding
        if (
            motion is not None
            and np.abs(wrapped(motion.at(np.array([motion.parameter(q)]))[0] - q)).max() < ON_CURVE
        ):
            return end
    return None
