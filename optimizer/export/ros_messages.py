"""`ros2` and `moveit`: messages with a joint trajectory, as YAML or as JSON for rosbridge.

Definitions: trajectory_msgs/msg/JointTrajectory, control_msgs/action/FollowJointTrajectory,
moveit_msgs/msg/RobotTrajectory; of rosbridge, ROSBRIDGE_PROTOCOL.md (operations `send_action_goal`
and `publish`).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import yaml

from joulepath.optimizer.export.facts import WrittenFile, header
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.export.quintic_points import QuinticPoints, quintic_points
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_text

Encoding = Literal["yaml", "json"]


@dataclass(frozen=True)
class GoalSettings:
    """Tolerances of a goal."""

    position_tolerance: float = 0.01
    """Largest distance of a joint from the end [rad]."""
    time_tolerance: int = 1
    """Time to reach the end after the motion [s]."""


GOAL = GoalSettings()


@dataclass(frozen=True)
class Ros2Options:
    """Options of `ros2`."""

    message: Literal["goal", "trajectory"] = "goal"
    """A FollowJointTrajectory goal or a JointTrajectory."""
    encoding: Encoding = "yaml"
    controller: str = "joint_trajectory_controller"
    """Name of the controller's node."""
    prefix: str = ""
    """Prefix of all joint names."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_text("controller", self.controller, OPTION_RANGES.controller)
        check_text("prefix", self.prefix, OPTION_RANGES.prefix)


@dataclass(frozen=True)
class MoveitOptions:
    """Options of `moveit`."""

    encoding: Encoding = "yaml"
    prefix: str = ""
    """Prefix of all joint names."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_text("prefix", self.prefix, OPTION_RANGES.prefix)


def to_ros2(program: Program, options: Ros2Options | None = None) -> WrittenFile:
    """Write a program as a message for a joint trajectory controller.

    Args:
        program: the motion.
        options: message, encoding, controller and prefix; None for the defaults.

    Raises:
        FormatUnsuitable: the motion is too long.
    """
    options = options or Ros2Options()
    points = quintic_points(program, "ros2")
    trajectory = joint_trajectory(program, points, options.prefix)
    controller = options.controller.lstrip("/")
    action, topic = f"/{controller}/follow_joint_trajectory", f"/{controller}/joint_trajectory"
    if options.message == "goal":
        tolerance = [
            {"name": name, "position": GOAL.position_tolerance}
            for name in trajectory["joint_names"]
        ]
        message = {
            "trajectory": trajectory,
            "goal_tolerance": tolerance,
            "goal_time_tolerance": {"sec": GOAL.time_tolerance, "nanosec": 0},
        }
        kind = "control_msgs/action/FollowJointTrajectory"
        wrapped = {
            "op": "send_action_goal",
            "action": action,
            "action_type": kind,
            "args": message,
            "feedback": True,
        }
        use = f"ros2 action send_goal {action} {kind} (this file in quotes)"
    else:
        kind = "trajectory_msgs/msg/JointTrajectory"
        message = trajectory
        wrapped = {"op": "publish", "topic": topic, "type": kind, "msg": message}
        use = f"ros2 topic pub --once {topic} {kind} (this file in quotes)"
    return _file(program, points, options.encoding, kind, use, message, wrapped)


def to_moveit(program: Program, options: MoveitOptions | None = None) -> WrittenFile:
    """Write a program as a RobotTrajectory for MoveIt.

    Args:
        program: the motion.
        options: encoding and prefix; None for the defaults.

    Raises:
        FormatUnsuitable: the motion is too long.
    """
    options, points = options or MoveitOptions(), quintic_points(program, "moveit")
    message = {
        "joint_trajectory": joint_trajectory(program, points, options.prefix),
        "multi_dof_joint_trajectory": {"joint_names": []},
    }
    kind = "moveit_msgs/msg/RobotTrajectory"
    use = "for MoveGroupInterface::execute"
    return _file(program, points, options.encoding, kind, use, message, message)


def joint_trajectory(program: Program, points: QuinticPoints, prefix: str) -> dict[str, Any]:
    """The fields of trajectory_msgs/msg/JointTrajectory without its header.

    Args:
        program: the motion.
        points: its points.
        prefix: prefix of all joint names.
    """
    rows = zip(
        points.nanoseconds, points.q.tolist(), points.v.tolist(), points.a.tolist(), strict=True
    )
    return {
        "joint_names": [prefix + name for name in program.robot.joint_names],
        "points": [
            {
                "positions": q,
                "velocities": v,
                "accelerations": a,
                "time_from_start": {"sec": t // 1_000_000_000, "nanosec": t % 1_000_000_000},
            }
            for t, q, v, a in rows
        ],
    }


def _file(
    program: Program,
    points: QuinticPoints,
    encoding: Encoding,
    kind: str,
    use: str,
    message: dict[str, Any],
    wrapped: dict[str, Any],
) -> WrittenFile:
    notes = (
        f"{len(points.nanoseconds)} points, and quintics between them are within "
        f"{points.position:.1e} rad and {points.velocity:.1e} rad/s of the spline",
        "payload and outputs are not in the message: set them on the robot",
        *(
            f"at {timed.t0:.4f} s the payload becomes {timed.payload.mass:.4g} kg"
            for timed in program.timed
            if timed.payload is not None
        ),
    )
    if encoding == "json":
        return WrittenFile.of_text(
            json.dumps(wrapped, allow_nan=False), "application/json", "json", notes
        )
    head = "".join(f"# {line}\n" for line in header(program, kind, (use, *notes)))
    # the dumper in C, where PyYAML has it: ten times as fast
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    body = yaml.dump(message, Dumper=dumper, default_flow_style=None, sort_keys=False, width=1000)
    return WrittenFile.of_text(head + body, "application/yaml", "yaml", notes)
