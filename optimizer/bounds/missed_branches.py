"""Lower bound on motions between configurations that no candidate has.

They are members of self-motions, and branches that an incomplete inverse kinematics may miss.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.end_curves import Curve, EndCurves
from joulepath.optimizer.bounds.free_ends_bound import bound_between_boxes, reversed_problem
from joulepath.optimizer.bounds.free_goal_bound import PoseFamily, family_bound
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.pair import Pair
from joulepath.optimizer.bounds.pose_cover import POSE_COVER, CoveredPose, cover
from joulepath.optimizer.bounds.self_motion_bound import bound_between_curves, self_motion_bound
from joulepath.optimizer.bounds.subdivide import SUBDIVISION, SearchLimits
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.branch_covers import branch_covers
from joulepath.optimizer.kinematics.covers.wrist_geometry import greatest_rates
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.orientation_tolerance import within_cone
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
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
    prepared: PreparedProblem, candidates: Sequence[Pair], deadline: Deadline = NEVER
) -> float:
    """Lower bound on motions between poses in configurations of no candidate [J]; inf for none.

    - If all branches are known, the other configurations are members of self-motions.
    - Else, if the arm is nearly of a form with known curves, `branch_covers` hold them.
    - Else, between given joint positions and poses, the bound covers the poses with any rotation
      about the last joint's axis, by boxes of joint positions, without inverse kinematics.
    - Else, between poses, it covers the motions between the boxes of `pose_cover` at both ends, or
      those between any two configurations for more than six joints, whose boxes would be too many.

    Args:
        prepared: problem of the motions.
        candidates: pairs of known end configurations.
        deadline: deadline of the search, which then returns its bound so far.
    """
    problem = prepared.problem
    if all_branches_known(problem):
        return self_motion_bound(prepared, candidates, deadline)
    has_free_goal = any(isinstance(goal, ConeOrientedPose) for goal in members(problem.goal))
    if not (_poses(problem.start) and has_free_goal):
        starts = _covered(prepared, [pair.start for pair in candidates], problem.start)
        goals = _covered(prepared, [pair.goal for pair in candidates], problem.goal)
        if starts is not None and goals is not None:
            return bound_between_curves(prepared, starts, goals, deadline)
    if _poses(problem.start) and problem.arm.robot.nq > POSE_FREEDOMS:
        return _bound_of_any(prepared)
    return _bound_by_boxes(prepared, candidates, deadline)


def _bound_by_boxes(
    prepared: PreparedProblem, candidates: Sequence[Pair], deadline: Deadline
) -> float:
    """Lower bound on motions from or to poses, in any of their configurations [J]."""
    problem = prepared.problem
    if problem.tool_path is not None:
        problem = prepared.freed(candidates[0].q_start)
    back = reversed_problem(problem, problem.goal, problem.start)
    starts, goals = _poses(prepared.problem.start), _poses(problem.goal)
    known = [pair.start for pair in candidates], [pair.goal for pair in candidates]
    found = [
        _bound_from_given(
            problem, _beside_poses(known[0], prepared.problem.start), goals, deadline
        ),
        _bound_from_given(back, _beside_poses(known[1], problem.goal), starts, deadline),
    ]
    free = [each for each in members(problem.goal) if isinstance(each, ConeOrientedPose)]
    searches, tight = len(starts) * len([*goals, *free]), problem.bound == "tight"
    rounds = POSE_COVER.tight_rounds if tight else POSE_COVER.rounds
    effort = SearchLimits(max(1, rounds // max(searches, 1)), deadline)
    limits = SearchLimits(max(1, _rounds(problem) // max(searches, 1)), deadline)
    for start in starts:
        # the greatest potential energy at the start is the least one under inverted gravity
        covered = CoveredPose.of(back, start)
        boxes = covered.boxes(effort)
        for goal in goals:
            to = CoveredPose.of(problem, goal)
            ends = (covered.family, to.family), (boxes, to.boxes(effort))
            found.append(bound_between_boxes(prepared, *ends, limits))
        for cone in free:
            family = PoseFamily(prepared, within_cone(prepared.arm, cone), False)
            ends = (covered.family, family), (boxes, cover(family, effort))
            found.append(bound_between_boxes(prepared, *ends, limits))
    return min(found)


def _beside_poses(ends: Sequence[EndConfiguration], target: Target) -> list[EndConfiguration]:
    """The ends that reach no pose of fixed orientation among the targets."""
    single = members(target)
    return [end for end in ends if not isinstance(single[end.target], Pose)]


def _bound_from_given(
    problem: Problem, ends: Sequence[EndConfiguration], poses: Sequence[Pose], deadline: Deadline
) -> float:
    """Lower bound on motions from given ends to poses in any configuration [J]; inf for none."""
    if not ends or not poses:
        return np.inf
    curves = EndCurves.of(ends)
    boxes, half = curves.boxes(curves.first())
    limits = SearchLimits(max(1, _rounds(problem) // len(poses)), deadline)
    families = [CoveredPose.of(problem, pose).family for pose in poses]
    return min(
        family_bound(each.prepared, each.pose, boxes, limits, half, curves.given)
        for each in families
    )


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


def _rounds(problem: Problem) -> int:
    """Rounds of the subdivision of boxes, shared by all searches."""
    return SUBDIVISION.tight_rounds if problem.bound == "tight" else SUBDIVISION.early_rounds


def _bound_of_any(prepared: PreparedProblem) -> float:
    """Lower bound on the motions between any two configurations [J].

    No joint need move between two configurations. But for full turns, which leave the potential
    energy as it is, configurations differ by at most half a turn in each joint: the potential
    energy falls by at most its greatest rate over half a turn.
    """
    fall = np.pi * float(greatest_rates(prepared.arm).sum())
    still = np.zeros((1, prepared.arm.robot.nq))
    return float(LeastBound(prepared).of(still, np.array([-fall]))[0])


def _poses(target: Target) -> list[Pose]:
    """Poses of fixed orientation among targets; the others are solved in samples in any case."""
    return [each for each in members(target) if isinstance(each, Pose)]
