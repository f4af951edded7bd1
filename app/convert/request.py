"""From requests for a motion to problems of the library."""

from __future__ import annotations

import numpy as np

from app.convert.arm import to_arm
from app.convert.pose import to_pose
from app.schemas import request as asked
from app.schemas.orientation import ConeOrientedPose as ConeOrientedPoseSchema
from app.schemas.orientation import InCone
from app.schemas.path import Path
from optimizer.problem.branches import BranchFilter
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.problem.cycle import Cycle
from optimizer.problem.problem import LONGEST_DURATION, Problem
from optimizer.problem.targets import AnyOf, Single, Target
from optimizer.problem.tool_path import ToolPath
from optimizer.replay.sampler import MOST_SAMPLES


def to_problem(request: asked.OptimizeRequest, deadline: float) -> Problem:
    """The problem of a request, of whose time `deadline` [s] is left.

    Raises UnknownRobot, InvalidProblem or OutsideLimits.
    """
    shortest, longest = _duration_bounds(request)
    path = request.path
    return Problem(
        start=to_target(request.start),
        goal=to_target(request.goal),
        arm=to_arm(request) if path is None else to_arm(request).no_faster_than(path.speed),
        tool_path=None if path is None else to_tool_path(path),
        method=request.method,
        objective=request.objective,
        duration_min=shortest,
        duration_max=longest,
        cycle=to_cycle(request.cycle),
        branch=to_branch(request.branch),
        windings=request.windings,
        bound=request.bound,
        sample_period=request.sample_period,
        deadline=deadline,
    )


def to_tool_path(path: Path) -> ToolPath:
    """The tool path of the library. Raises InvalidProblem."""
    return ToolPath(
        shape=path.shape,
        via=[to_pose(pose.position, pose) for pose in path.via],
        blend=path.blend,
        position_tolerance=path.tolerance.position,
        rotation_tolerance=path.tolerance.rotation,
    )


def to_branch(branch: asked.Branch | None) -> BranchFilter | None:
    """The branch filter of the library."""
    return None if branch is None else BranchFilter(branch.shoulder, branch.elbow, branch.wrist)


def to_cycle(asked_for: asked.Cycle | None) -> Cycle | None:
    """The cycle of the library. Raises InvalidProblem."""
    if asked_for is None:
        return None
    return Cycle(asked_for.time, asked_for.hold, asked_for.brake_delay, asked_for.brake_power)


def to_target(target: asked.Target) -> Target:
    """The target of the library."""
    if isinstance(target, asked.AnyOfTarget):
        return AnyOf(tuple(_single(member) for member in target.any_of))
    return _single(target)


def _single(target: asked.JointTarget | asked.PoseTarget) -> Single:
    if isinstance(target, asked.JointTarget):
        return np.array(target.q)
    pose = target.pose
    return _cone_oriented(pose) if isinstance(pose, ConeOrientedPoseSchema) else to_pose(pose.position, pose)


def _cone_oriented(pose: ConeOrientedPoseSchema) -> ConeOrientedPose:
    position, orientation = np.array(pose.position), pose.orientation
    if isinstance(orientation, str):
        return ConeOrientedPose(position)
    if isinstance(orientation, InCone):
        cone = orientation.cone
        return ConeOrientedPose(position, np.array(cone.axis), np.array(cone.direction), cone.half_angle)
    return ConeOrientedPose.about(to_pose(pose.position, orientation), np.array(orientation.free_about))


def _duration_bounds(request: asked.MotionRequest) -> tuple[float | None, float | None]:
    """Smallest and largest duration [s]. If an electrical request has no largest one, the service's limits
    apply."""
    if isinstance(request.duration, float | int):
        return request.duration, request.duration
    given = request.duration or asked.DurationRange()
    if given.max is None and request.objective == "electrical":
        return given.min, min(LONGEST_DURATION, request.sample_period * MOST_SAMPLES)
    return given.min, given.max
