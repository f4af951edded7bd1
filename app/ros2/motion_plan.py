"""MoveIt's motion plan requests as fields of `POST /optimize`.

Messages are read by their fields, so that this module needs no installation of ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from joulepath.app.client.errors import ServiceUnreachable
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.ros2.messages import JointNames, Json, pose_target, refusal
from joulepath.optimizer.deadline import Stopped
from joulepath.optimizer.exceptions import (
    DeadlineExceeded,
    NoConfigurationFound,
    OutsideLimits,
    SingularPose,
    UnreachablePose,
)
from joulepath.optimizer.search.errors import GoalInCollision, StartInCollision

REQUEST = "motion_plan_request"
"""Name of the message in errors."""
SUCCESS = 1
"""Code of a plan in moveit_msgs/msg/MoveItErrorCodes."""
PLANNING_FAILED = -1
"""Code of all errors outside of `ERROR_CODES`."""
ERROR_CODES: dict[type[BaseException], int] = {
    Stopped: -7,
    DeadlineExceeded: -6,
    StartInCollision: -10,
    GoalInCollision: -12,
    OutsideLimits: -27,
    InvalidRequest: -16,
    UnreachablePose: -31,
    NoConfigurationFound: -31,
    SingularPose: -31,
    ServiceUnreachable: -25,
}
"""Codes of errors: preempted, timed out, start and goal in collision, invalid goal state, invalid
goal constraints, no inverse kinematics, communication failure.
"""


def error_code(error: BaseException) -> int:
    """The code of an error in moveit_msgs/msg/MoveItErrorCodes."""
    return next(
        (code for kind, code in ERROR_CODES.items() if isinstance(error, kind)), PLANNING_FAILED
    )


def request_of(
    request: Any, names: JointNames, limits: Mapping[str, Any], frame: str, link: str
) -> Json:
    """A moveit_msgs/msg/MotionPlanRequest as fields of `POST /optimize`.

    Args:
        request: the message.
        names: joints of the robot.
        limits: `limits` of `POST /optimize`, of which its factors scale `velocity` [rad/s] and
            `acceleration` [rad/s²].
        frame: frame of the robot's base.
        link: the link with the TCP; a goal may constrain its pose.

    Raises:
        InvalidRequest: no plan can fulfil a field of the request; the error names it.
    """
    for field in ("path_constraints", "trajectory_constraints"):
        asked = getattr(request, field)
        parts = (value for name, value in _fields(asked) if name != "name")
        if any(len(part) for part in parts):
            raise _refused(field, "Constraints on the path are not planned: leave them out.")
    fields: Json = {"goal": _goal(request.goal_constraints, names, frame, link)}
    state = request.start_state.joint_state
    if state.name:
        q = names.positions(f"{REQUEST}.start_state", state.name, state.position)
        fields["start"] = {"q": q}
    if request.allowed_planning_time > 0:
        fields["deadline"] = request.allowed_planning_time
    slower = dict(limits)
    for kind in ("velocity", "acceleration"):
        if 0 < (factor := getattr(request, f"max_{kind}_scaling_factor")) < 1:
            slower[kind] = (factor * np.array(limits[kind])).tolist()
    if request.max_cartesian_speed > 0:
        speeds = (request.max_cartesian_speed, limits.get("tcp_speed"))
        slower["tcp_speed"] = min(each for each in speeds if each is not None)
    return fields | {"limits": slower}


def _goal(goals: Any, names: JointNames, frame: str, link: str) -> Json:
    if len(goals) != 1:
        raise _refused("goal_constraints", f"Give one goal: there are {len(goals)}.")
    (goal,) = goals
    joints, places, turns = (
        goal.joint_constraints,
        goal.position_constraints,
        goal.orientation_constraints,
    )
    if goal.visibility_constraints or (joints and (places or turns)):
        raise _refused(
            "goal_constraints", "Give joint constraints, or a position and an orientation."
        )
    if joints:
        positions = [each.position for each in joints]
        topic = f"{REQUEST}.goal_constraints"
        return {"q": names.positions(topic, [each.joint_name for each in joints], positions)}
    if len(places) != 1 or len(turns) != 1:
        raise _refused(
            "goal_constraints",
            f"Give all joints, or one position and one orientation: there are {len(places)} "
            f"positions and {len(turns)} orientations.",
        )
    (place,), (turn,) = places, turns
    centres, offset = place.constraint_region.primitive_poses, place.target_point_offset
    if len(centres) != 1 or any((offset.x, offset.y, offset.z)):
        raise _refused(
            "goal_constraints",
            "Give one primitive as the region of the position, about the target, and no offset.",
        )
    named = {place.link_name, turn.link_name}
    if named != {names.prefix + link}:
        raise _refused(
            "goal_constraints",
            f"Poses are those of the link {names.prefix + link}, not of "
            f"{', '.join(sorted(named))}: set the parameter `tip_link`.",
        )
    if place.header.frame_id != turn.header.frame_id:
        raise _refused("goal_constraints", "Give position and orientation in the same frame.")
    p, q = centres[0].position, turn.orientation
    return pose_target(
        f"{REQUEST}.goal_constraints",
        place.header.frame_id,
        (p.x, p.y, p.z),
        (q.x, q.y, q.z, q.w),
        names.prefix,
        frame,
    )


def _fields(message: Any) -> list[tuple[str, Any]]:
    return [(name, getattr(message, name)) for name in message.get_fields_and_field_types()]


def _refused(field: str, message: str) -> InvalidRequest:
    return refusal((REQUEST, field), message)
