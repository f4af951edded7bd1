"""Lower bound on motions between configurations that no candidate has.

They are members of self-motions, and branches that an incomplete inverse kinematics may miss.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.end_curves import Curve, EndCurves
from joulepath.optimizer.bounds.free_goal_bound import family_bound
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.self_motion_bound import bound_between_curves, self_motion_bound
from joulepath.optimizer.bounds.subdivide import SUBDIVISION, SearchLimits
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.branch_covers import branch_covers
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target, members


def all_branches_known(problem: Problem) -> bool:
    """Whether the inverse kinematics finds every branch of every pose among the targets."""
    kinematics = inverse_kinematics_for(problem.arm.robot)
    return (kinematics is None or kinematics.complete) or not (
        _poses(problem.start) + _poses(problem.goal)
    )


def bound_of_missed_branches(
    prepared: PreparedProblem,
    candidates: Sequence[Pair],
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Lower bound on motions between poses in configurations of no candidate [J]; inf for none.

    - If all branches are known, the other configurations are members of self-motions.
    - Else, if the arm is nearly of a form with known curves, `branch_covers` hold them.
    - Else, from given joint positions, the bound covers the motions to the goal poses with any
      rotation about their z axes, by boxes of joint positions, without inverse kinematics.
    - Else, between poses, the bound covers the motions between any two configurations.

    Args:
        prepared: problem of the motions.
        candidates: pairs of known end configurations.
        deadline: deadline of the search, which then returns its bound so far.
        enough: sufficient bound [J], as in `self_motion_bound`.
    """
    problem = prepared.problem
    if all_branches_known(problem):
        return self_motion_bound(prepared, candidates, deadline, enough)
    between_poses = bool(_poses(problem.start))
    has_free_goal = any(isinstance(goal, ConeOrientedPose) for goal in members(problem.goal))
    if not (between_poses and has_free_goal):
        starts = _covered(prepared, [pair.start for pair in candidates], problem.start)
        goals = _covered(prepared, [pair.goal for pair in candidates], problem.goal)
        if starts is not None and goals is not None:
            return bound_between_curves(prepared, starts, goals, deadline, enough)
    if between_poses:
        return _bound_of_any(prepared)
    poses = [
        ConeOrientedPose.about(pose, np.array([0.0, 0.0, 1.0])) for pose in _poses(problem.goal)
    ]
    curves = EndCurves.of([pair.start for pair in candidates])
    boxes, half = curves.boxes(curves.first())
    tight = problem.bound == "tight"
    rounds = SUBDIVISION.tight_rounds if tight else SUBDIVISION.early_rounds
    limits = SearchLimits(max(1, rounds // len(poses)), deadline)
    return min(family_bound(prepared, pose, boxes, limits, half, curves.given) for pose in poses)


def _covered(
    prepared: PreparedProblem, ends: Sequence[EndConfiguration], target: Target
) -> EndCurves | None:
    """Joint positions given at one end, and covers with all configurations of its poses.

    It is None for an arm without such covers. Poses of partly free orientation are left to
    `free_goal_bound`.
    """
    arm = prepared.arm
    isolated = {end.q.tobytes(): end.q for end in ends if end.fixed and not end.sampled}
    curves: list[Curve] = list[Array | Curve](isolated.values())
    poses = _poses(target)
    for pose in poses:
        covers = branch_covers(arm.robot, flange_pose(pose.T, arm.T_flange_tcp))
        if covers is None:
            return None
        curves += covers
    return EndCurves(arm.robot.nq, curves, not poses)


def _bound_of_any(prepared: PreparedProblem) -> float:
    """Lower bound on the motions between any two configurations [J].

    No joint need move between two configurations. But for full turns, which leave the potential
    energy as it is, configurations differ by at most half a turn in each joint: the potential
    energy falls by at most its greatest rate over half a turn.
    """
    fall = np.pi * float(potential_rates(prepared.model, prepared.arm.gravity).sum())
    still = np.zeros((1, prepared.arm.robot.nq))
    return float(LeastBound(prepared).of(still, np.array([-fall]))[0])


def _poses(target: Target) -> list[Pose]:
    """Poses of fixed orientation among targets; the others are solved in samples in any case."""
    return [each for each in members(target) if isinstance(each, Pose)]
