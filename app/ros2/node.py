"""The node: planning by messages and services of standard packages."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
import yaml
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import PoseStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from joulepath.app.client import Client
from joulepath.app.http.problems import problem_of
from joulepath.app.ros2.messages import JointNames, Json, pose_target, refusal, summary_of
from joulepath.app.ros2.parameters import Parameters
from joulepath.app.ros2.planner import LocalPlanner, Plan, Planner, RemotePlanner
from joulepath.optimizer.deadline import Stopped
from joulepath.optimizer.exceptions import DeclaredError

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Late subscribers get the last message, too: that of `robot_description` likewise."""
THREADS = 3
"""Threads of the executor: `~/plan` waits in one, the other callbacks go on."""


@dataclass
class _Work:
    """A goal that is planned, or was."""

    goal: Json
    stamp: Json
    stopped: threading.Event = field(default_factory=threading.Event)


class PlanningNode(Node):
    """Plans the motion of least energy from the current joint state to the last goal.

    It subscribes to `joint_states`, `~/goal_pose` and `~/goal_joints`. A goal is planned as soon as
    it arrives, and ends the plan of an earlier one. `~/plan` plans to the last goal again, and
    `~/cancel` ends a plan. A plan is published on `~/trajectory`; `~/summary` has its figures, or
    the problem, as JSON.
    """

    def __init__(self, **options: Any) -> None:
        """Declare the parameters, and begin to load the robot.

        Args:
            options: options of `rclpy.node.Node`.

        Raises:
            DeclaredError: a parameter is wrong, or the robot is unknown.
        """
        super().__init__("joulepath", **options)
        self._parameters = Parameters.declared(self)
        self._planner: Planner | None = None
        self._start: JointState | None = None
        self._work: _Work | None = None
        self._pool = ThreadPoolExecutor(1)
        self._trajectories = self.create_publisher(JointTrajectory, "~/trajectory", LATCHED)
        self._summaries = self.create_publisher(String, "~/summary", LATCHED)
        self.create_subscription(
            JointState, "joint_states", self._on_state, qos_profile_sensor_data
        )
        self.create_subscription(PoseStamped, "~/goal_pose", self._on_pose, 10)
        self.create_subscription(JointState, "~/goal_joints", self._on_joints, 10)
        self.create_service(Trigger, "~/cancel", self._on_cancel)
        # waits for the plan: the other callbacks must go on
        alone = MutuallyExclusiveCallbackGroup()
        self.create_service(Trigger, "~/plan", self._on_plan, callback_group=alone)
        self._load()

    def close(self) -> None:
        """End the plan that is computed, and the node."""
        if self._work is not None:
            self._work.stopped.set()
        self._pool.shutdown()
        self.destroy_node()

    def _load(self) -> None:
        """The planner of the named robot, or a subscription to its description."""
        own = self._parameters
        if own.url:
            client = Client(own.url, own.api_key or None)
            self._planner = RemotePlanner(client, own.robot, own.prefix)
        elif own.robot:
            self._planner = LocalPlanner(own.robot, own.prefix)
        else:
            self.create_subscription(String, "robot_description", self._on_description, LATCHED)
            return
        self.get_logger().info(f"Ready to plan for {own.robot}")

    def _on_description(self, message: String) -> None:
        own = self._parameters
        try:
            self._planner = LocalPlanner.of_description(own.description(message.data), own.prefix)
        except DeclaredError as error:
            self._tell(_refused(error))
            return
        self.get_logger().info("Ready to plan for the robot in robot_description")

    def _on_state(self, message: JointState) -> None:
        self._start = message

    def _on_pose(self, message: PoseStamped) -> None:
        pose, own = message.pose, self._parameters
        position, turn = pose.position, pose.orientation
        self._take(
            message,
            lambda: pose_target(
                "goal_pose",
                message.header.frame_id,
                (position.x, position.y, position.z),
                (turn.x, turn.y, turn.z, turn.w),
                own.prefix,
                own.base_frame,
            ),
        )

    def _on_joints(self, message: JointState) -> None:
        self._take(message, lambda: {"q": self._positions("goal_joints", message)})

    def _take(self, message: Any, target: Callable[[], Json]) -> None:
        """Plan to the goal of a message."""
        stamp = message.header.stamp
        try:
            goal = target()
        except DeclaredError as error:
            self._tell(_refused(error) | {"goal_stamp": _stamp(stamp)})
            return
        self._begin(goal, _stamp(stamp))

    def _begin(self, goal: Json, stamp: Json) -> Future[Json]:
        """Plan in the other thread; an earlier plan ends."""
        if self._work is not None:
            self._work.stopped.set()
        self._work = work = _Work(goal, stamp)
        return self._pool.submit(self._plan, work)

    def _on_plan(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._work is None:
            error = refusal(
                ("goal",),
                "There is no goal yet: publish one on ~/goal_pose or ~/goal_joints.",
            )
            summary = _refused(error)
        else:
            summary = self._begin(self._work.goal, self._work.stamp).result()
        response.success = summary["state"] == "planned"
        response.message = json.dumps(summary)
        return response

    def _on_cancel(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._work is not None:
            self._work.stopped.set()
        response.success = True
        return response

    def _plan(self, work: _Work) -> Json:
        """Publish the trajectory and the summary of a plan; returns the summary."""
        try:
            plan = self._planned(work)
        except Stopped:
            summary: Json = {"state": "cancelled"}
        except DeclaredError as error:
            summary = _refused(error)
        except Exception as error:
            self.get_logger().error(f"A defect of joulepath: {error!r}")
            summary = _refused(error)
        else:
            self._trajectories.publish(_trajectory(plan.trajectory))
            summary = summary_of(plan.answer)
        summary["goal_stamp"] = work.stamp
        self._tell(summary)
        return summary

    def _planned(self, work: _Work) -> Plan:
        if work.stopped.is_set():
            raise Stopped
        if self._planner is None:
            raise refusal(
                ("robot_description",),
                "No robot is known yet: publish its URDF on robot_description, or set the "
                "parameter `robot`.",
            )
        if self._start is None:
            raise refusal(
                ("joint_states",),
                "No joint state has arrived: publish it on joint_states, or remap this topic.",
            )
        start = {"q": self._positions("joint_states", self._start)}
        body = self._parameters.request() | {"start": start, "goal": work.goal}
        return self._planner.plan(body, work.stopped.is_set)

    def _positions(self, topic: str, message: JointState) -> list[float]:
        joints = () if self._planner is None else self._planner.joints
        names = JointNames(joints, self._parameters.prefix)
        return names.positions(topic, message.name, message.position)

    def _tell(self, summary: Json) -> None:
        self._summaries.publish(String(data=json.dumps(summary)))


def _trajectory(fields: Json) -> JointTrajectory:
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


def _refused(error: Exception) -> Json:
    document = getattr(error, "document", None) or problem_of(error, "")
    return {"state": "refused", "problem": document}


def _stamp(stamp: Any) -> Json:
    return {"sec": stamp.sec, "nanosec": stamp.nanosec}


def main(arguments: list[str]) -> None:
    """Run the node until it is interrupted.

    Args:
        arguments: command line of ROS, such as `--ros-args -p robot:=ur5e`.

    Raises:
        DeclaredError: a parameter is wrong, or the robot is unknown.
    """
    rclpy.init(args=arguments)
    node = None
    try:
        node = PlanningNode()
        executor = MultiThreadedExecutor(THREADS)
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            node.close()
        rclpy.try_shutdown()
