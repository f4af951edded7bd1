"""What can be said of branches that an inverse kinematics may have missed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.box_search import FEW, TIGHT_ROUNDS
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.covers.branch_covers import BranchCover, branch_covers
from joulepath.optimizer.kinematics.covers.wrist_geometry import potential_rates
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Side, Target, members
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.free_goal_bound import family_bound
from joulepath.optimizer.search.self_motion_bound import EndCurves, bound_between, self_motion_bound


def all_known(problem: Problem) -> bool:
    """Whether every branch of every pose among the targets is found, if it is reached at all."""
    kinematics = inverse_kinematics_for(problem.arm.robot)
    return (kinematics is None or kinematics.complete) or not (
        _poses(problem.start) + _poses(problem.goal)
    )


def bound_of_others(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    deadline: Deadline = NEVER,
    enough: float = np.inf,
) -> float:
    """Lower bound [J] on the motions between poses in configurations that are none of the
    candidates; inf if there are none.

    If all branches are known, the others are on self-motions. Else they may be anywhere. Of an arm
    that is nearly of a form whose curves are known, they are on `branch_covers`. From given joint
    positions of any other arm the bound is that of the motions to the goal poses with any rotation
    about their z axes, by boxes of joint positions that need no inverse kinematics. From poses it
    is that of the motions between any two configurations. `enough` [J]: see `self_motion_bound`.
    """
    problem = prepared.problem
    if all_known(problem):
        return self_motion_bound(prepared, candidates, deadline, enough)
    between_poses = bool(_poses(problem.start))
    if not (
        between_poses and any(isinstance(each, ConeOrientedPose) for each in members(problem.goal))
    ):
        starts, goals = (
            _covered(prepared, candidates, "start"),
            _covered(prepared, candidates, "goal"),
        )
        if starts is not None and goals is not None:
            return bound_between(prepared, starts, goals, deadline, enough)
    if between_poses:
        return _bound_of_any(prepared)
    poses = [
        ConeOrientedPose.about(pose, np.array([0.0, 0.0, 1.0])) for pose in _poses(problem.goal)
    ]
    curves = EndCurves.of([each.start for each in candidates])
    boxes, half = curves.boxes(curves.first())
    rounds = max(1, (TIGHT_ROUNDS if problem.bound == "tight" else FEW) // len(poses))
    return min(
        family_bound(prepared, pose, boxes, rounds, deadline, half, given=curves.given)
        for pose in poses
    )


def _covered(
    prepared: PreparedProblem, candidates: Sequence[Candidate], name: Side
) -> EndCurves | None:
    """Joint positions that are given at one end, and all that reaches its poses; None of an arm
    whose poses are not covered. Poses of free orientation are left to `free_goal_bound`."""
    arm, curves = prepared.arm, dict[int, Array | BranchCover]()
    for end in (getattr(candidate, name) for candidate in candidates):
        if end.fixed and not end.sampled:
            curves[id(end.q)] = end.q
    given = True
    for pose in _poses(getattr(prepared.problem, name)):
        covers = branch_covers(arm.robot, flange_pose(pose.T, arm.T_flange_tcp))
        if covers is None:
            return None
        curves |= {id(each): each for each in covers}
        given = False
    return EndCurves(arm.robot.nq, list(curves.values()), given)


def _bound_of_any(prepared: PreparedProblem) -> float:
    """Lower bound [J] on the motions between any two configurations.

    Between two configurations no joint need move. But for full turns, which change no potential
    energy, they differ by at most half a turn in each joint: the potential energy falls by at most
    its greatest rate over that.
    """
    fall = np.pi * float(potential_rates(prepared.model, prepared.arm.gravity).sum())
    return float(
        LeastBound(prepared).of(np.zeros((1, prepared.arm.robot.nq)), np.array([-fall]))[0]
    )


def _poses(target: Target) -> list[Pose]:
    """The poses among targets. Of a pose whose orientation is free in part, only samples are solved
    in any case.
    """
    return [each for each in members(target) if isinstance(each, Pose)]
