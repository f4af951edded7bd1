"""Trajectories as messages."""

from __future__ import annotations

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from joulepath.app.ros2.messages import Json


def trajectory_message(fields: Json) -> JointTrajectory:
    """The message. The stamp of its header is zero: a controller begins at once."""
    points = [
        JointTrajectoryPoint(
            positions=each["positions"],
            velocities=each["velocities"],
            accelerations=each["accelerations"],
            time_from_start=Duration(**each["time_from_start"]),
        )
        for each in fields["points"]
    ]
    return JointTrajectory(joint_names=fields["joint_names"], points=points)
