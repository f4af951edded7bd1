"""From the schemas of poses and orientations to the optimizer's poses."""

from __future__ import annotations

from collections.abc import Sequence

from app.schemas import common as asked
from models.robot import Array
from optimizer.problem.pose import Pose


def to_pose(position: Sequence[float], orientation: asked.WithQuaternion | asked.WithRpy | asked.WithRotvec) -> Pose:
    """The pose at `position` [m] with an orientation given as one of `quaternion`, `rpy` and `rotvec`."""
    if isinstance(orientation, asked.WithQuaternion):
        return Pose.from_quaternion(position, orientation.quaternion)
    if isinstance(orientation, asked.WithRpy):
        return Pose.from_rpy(position, orientation.rpy)
    return Pose.from_rotvec(position, orientation.rotvec)


def to_matrix(pose: asked.Pose) -> Array:
    """Homogeneous matrix (4, 4) of the pose of any frame [m]."""
    return to_pose(pose.position, pose).T
