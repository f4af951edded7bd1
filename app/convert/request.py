"""From requests for a motion to problems of the library."""

from __future__ import annotations

import numpy as np

from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.pose import to_base, to_base_pose, to_pose
from joulepath.app.convert.until import time_left, until
from joulepath.app.schemas import request as asked
from joulepath.app.schemas.orientation import ConeOrientedPose as ConeOrientedPoseSchema
from joulepath.app.schemas.orientation import InCone, TargetPose
from joulepath.app.schemas.path import Path, StopPath
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.problem.targets import AnyOf, Single, Target
from joulepath.optimizer.problem.tool_path import ToolPath


def to_problem(request: asked.OptimizeRequest, deadline: float) -> Problem:
    """The problem of a request with a remaining time of `deadline` [s].

    Raises UnknownRobot, InvalidProblem, OutsideLimits or DeadlineExceeded.
    """
    end = Deadline.after(deadline)
    shortest, longest = _duration_bounds(request)
    with until(end):
        path, arm = request.path, to_arm(request)
    return Problem(
        start=to_target(request.start, arm.robot),
        goal=to_target(request.goal, arm.robot),
        arm=arm if path is None else arm.no_faster_than(path.bounds.limit),
        tool_path=None if path is None else to_tool_path(path, arm.robot),
        method=request.method,
        objective=request.objective,
        duration_min=shortest,
        duration_max=longest,
        dwell=to_dwell(request.dwell),
        branch=to_branch(request.branch),
        windings=request.windings,
        bound=request.bound,
        sample_period=request.sample_period,
        deadline=time_left(end),
    )


def to_tool_path(path: Path | StopPath, robot: Robot) -> ToolPath:
    """The tool path of the library. Raises InvalidProblem."""
    return ToolPath(
        shape=path.shape,
        via=[to_base_pose(pose, robot) for pose in path.via],
        blend=path.blend,
        position_tolerance=path.tolerance.position,
        rotation_tolerance=path.tolerance.rotation,
        about=path.tolerance.about,
        least_speed=path.bounds.min,
        fixed_speed=path.bounds.fixed,
        ramp=path.bounds.ramp,
    )


def to_branch(branch: asked.Branch | None) -> BranchFilter | None:
    """The branch filter of the library."""
    return None if branch is None else BranchFilter(branch.shoulder, branch.elbow, branch.wrist)


def to_dwell(asked_for: asked.Dwell | None) -> Dwell | None:
    """The dwell of the library. Raises InvalidProblem."""
    if asked_for is None:
        return None
    return Dwell(asked_for.time, asked_for.hold, asked_for.brake_delay, asked_for.brake_power)


def to_target(target: asked.Target, robot: Robot) -> Target:
    """The target of the library."""
    if isinstance(target, asked.AnyOfTarget):
        return AnyOf(tuple(_single(member, robot) for member in target.any_of))
    return _single(target, robot)


def _single(target: asked.JointTarget | asked.PoseTarget, robot: Robot) -> Single:
    if isinstance(target, asked.JointTarget):
        return np.array(target.q)
    return to_target_pose(target.pose, robot)


def to_target_pose(pose: TargetPose, robot: Robot) -> Pose | ConeOrientedPose:
    """The pose of the library, its orientation in full or free in part. Raises InvalidProblem."""
    if isinstance(pose, ConeOrientedPoseSchema):
        return _cone_oriented(pose, to_base(pose.frame, robot))
    return to_base_pose(pose, robot)


def _cone_oriented(pose: ConeOrientedPoseSchema, T_base_frame: Array) -> ConeOrientedPose:
    R, orientation = T_base_frame[:3, :3], pose.orientation
    position = R @ pose.position + T_base_frame[:3, 3]
    if isinstance(orientation, str):
        return ConeOrientedPose(position)
    if isinstance(orientation, InCone):
        cone = orientation.cone
        return ConeOrientedPose(position, np.array(cone.axis), R @ cone.direction, cone.half_angle)
    given = Pose(T_base_frame @ to_pose(pose.position, orientation).T)
    return ConeOrientedPose.about(given, np.array(orientation.free_about))


def _duration_bounds(request: asked.MotionRequest) -> tuple[float | None, float | None]:
    """Smallest and largest duration [s]. If an electrical request has no largest one, the service's
    limits apply."""
    if isinstance(request.duration, float | int):
        return request.duration, request.duration
    given = request.duration or asked.DurationRange()
    if given.max is None and request.objective == "electrical":
        return given.min, min(DURATIONS.longest, request.sample_period * MOTION_LIMITS.max_samples)
    return given.min, given.max
