"""From the schemas of poses and orientations to the optimizer's poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.app.schemas import common as asked
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.problem.pose import Pose


def to_pose(
    position: Sequence[float], orientation: asked.WithQuaternion | asked.WithRpy | asked.WithRotvec
) -> Pose:
    """The pose at `position` [m] with an orientation given as one of `quaternion`, `rpy` and
    `rotvec`.
    """
    if isinstance(orientation, asked.WithQuaternion):
        return Pose.from_quaternion(position, orientation.quaternion)
    if isinstance(orientation, asked.WithRpy):
        return Pose.from_rpy(position, orientation.rpy)
    return Pose.from_rotvec(position, orientation.rotvec)


def to_base(frame: asked.Frame, robot: Robot) -> Array:
    """Pose (4, 4) of a frame at the robot's base in `base` [m]."""
    return robot.T_base_base_link if frame == "base_link" else np.eye(4)


def to_base_pose(pose: asked.BasePose, robot: Robot) -> Pose:
    """A pose given in `base` or `base_link`, in the robot's base frame."""
    if pose.frame == "base":
        return to_pose(pose.position, pose)
    return Pose(to_base(pose.frame, robot) @ to_matrix(pose))


def to_matrix(pose: asked.Pose) -> Array:
    """Homogeneous matrix (4, 4) of the pose of any frame [m]."""
    return to_pose(pose.position, pose).T
