"""The node: planning by messages and services of standard packages."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeVar

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.task import Future as RosFuture
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from joulepath.app.client.client import Client
from joulepath.app.client.errors import ServiceUnreachable
from joulepath.app.engine.result import json_document
from joulepath.app.http.problems import problem_of
from joulepath.app.ros2.messages import JointNames, Json, pose_target, refusal, summary_of
from joulepath.app.ros2.parameters import Parameters
from joulepath.app.ros2.planner import LocalPlanner, Plan, Planner, RemotePlanner
from joulepath.app.ros2.planning_scene import PlanningScene
from joulepath.app.ros2.trajectory import trajectory_message
from joulepath.optimizer.deadline import Stopped
from joulepath.optimizer.exceptions import DeclaredError
from joulepath.optimizer.optimize import warm_up

T = TypeVar("T")
Outcome = Plan | Exception | Stopped
"""A plan, or why there is none."""
UNREACHABLE = "service-unreachable"
"""Type of the problem that no service answers."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Late subscribers get the last message, too: that of `robot_description` likewise."""


@dataclass(frozen=True)
class _Work:
    """A plan to a goal.

    Attributes:
        fields: returns the fields of `POST /optimize` that the message has: `goal`, and perhaps
            `start` and others; raises InvalidRequest.
        stamp: stamp of the message with the goal.
        stopped: set once the plan is of no use any more.
    """

    fields: Callable[[], Json]
    stamp: Json
    stopped: threading.Event = field(default_factory=threading.Event)


class PlanningNode(Node):
    """Plans the motion of least energy from the current joint state to the last goal.

    It subscribes to `joint_states`, `~/goal_pose` and `~/goal_joints`. A goal is planned as soon as
    it arrives, and ends the plan of an earlier one. `~/plan` plans to the last goal again, and
    `~/cancel` ends a plan. A plan is published on `~/trajectory`; `~/summary` has its figures, or
    the problem, as JSON.
    """

    def __init__(self, planner: Planner | None = None, **options: Any) -> None:
        """Declare the parameters, and load the robot.

        Args:
            planner: computes the plans; None for that of the parameters.
            options: options of `rclpy.node.Node`.

        Raises:
            DeclaredError: a parameter is wrong, or the robot is unknown.
        """
        super().__init__("joulepath", **options)
        self._parameters = own = Parameters.declared(self)
        self._planner = planner
        self.joint_state: JointState | None = None
        """The last message on `joint_states`; None before the first."""
        self._work: _Work | None = None
        self.scene: PlanningScene | None = None
        """Obstacles of a planning scene; None without the messages of MoveIt."""
        self._pool = ThreadPoolExecutor(1)
        self._trajectories = self.create_publisher(JointTrajectory, "~/trajectory", LATCHED)
        self._summaries = self.create_publisher(String, "~/summary", LATCHED)
        self.create_subscription(
            JointState, "joint_states", self._on_state, qos_profile_sensor_data
        )
        self.create_subscription(PoseStamped, "~/goal_pose", self._on_pose, 10)
        self.create_subscription(JointState, "~/goal_joints", self._on_joints, 10)
        self.create_service(Trigger, "~/cancel", self._on_cancel)
        self.create_service(Trigger, "~/plan", self._on_plan)
        if find_spec("moveit_msgs") is not None:
            from joulepath.app.ros2.moveit import MoveitInterface

            self.scene = MoveitInterface(self, own).scene
        if planner is None and own.robot and not own.url:
            self._planner = LocalPlanner(own.robot, own.prefix)
            self._pool.submit(warm_up, own.robot)
        elif planner is None and not own.robot:
            self.create_subscription(String, "robot_description", self._on_description, LATCHED)

    @property
    def planner(self) -> Planner | None:
        """What computes the plans; None while no robot is known."""
        return self._planner

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the robot's joints without the prefix; empty while no robot is known."""
        return () if self._planner is None else self._planner.joints

    def close(self) -> None:
        """End the plan that is computed, and the node."""
        if self._work is not None:
            self._work.stopped.set()
        self._pool.shutdown()
        self.destroy_node()

    def _on_description(self, message: String) -> None:
        own = self._parameters
        try:
            self._planner = LocalPlanner.of_description(own.description(message.data), own.prefix)
        except DeclaredError as error:
            self.refuse(error)

    def _on_state(self, message: JointState) -> None:
        self.joint_state = message

    def _on_pose(self, message: PoseStamped) -> None:
        pose, own = message.pose, self._parameters
        position, turn = pose.position, pose.orientation
        goal = partial(
            pose_target,
            "goal_pose",
            message.header.frame_id,
            (position.x, position.y, position.z),
            (turn.x, turn.y, turn.z, turn.w),
            own.prefix,
            own.base_frame,
        )
        self._begin(_Work(lambda: {"goal": goal()}, _stamp(message.header.stamp)), self._plan)

    def _on_joints(self, message: JointState) -> None:
        def fields() -> Json:
            return {"goal": {"q": self._positions("goal_joints", message)}}

        self._begin(_Work(fields, _stamp(message.header.stamp)), self._plan)

    def outcome(self, fields: Callable[[], Json]) -> RosFuture[Outcome]:
        """A plan that is not published, or its error; an earlier plan ends.

        Args:
            fields: returns fields of `POST /optimize`, of which `goal` is one; raises
                InvalidRequest.
        """
        return self._begin(_Work(fields, {}), self._outcome)

    def _begin(self, work: _Work, compute: Callable[[_Work], T]) -> RosFuture[T]:
        """Compute in the other thread; an earlier plan ends."""
        if self._work is not None:
            self._work.stopped.set()
        self._work = work
        done: RosFuture[T] = RosFuture()

        def plan() -> None:
            done.set_result(compute(work))
            # a callback that awaits the plan goes on with the next turn of the executor
            if self.executor is not None:
                self.executor.wake()

        self._pool.submit(plan)
        return done

    async def _on_plan(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._work is None:
            error = refusal(
                ("goal",),
                "There is no goal yet: publish one on ~/goal_pose or ~/goal_joints.",
            )
            summary = _refused(error)
        else:
            summary = await self._begin(_Work(self._work.fields, self._work.stamp), self._plan)
        response.success = summary["state"] == "planned"
        response.message = _text(summary)
        return response

    def _on_cancel(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._work is not None:
            self._work.stopped.set()
        response.success = True
        return response

    def _plan(self, work: _Work) -> Json:
        """Publish the trajectory and the summary of a plan; returns the summary."""
        plan = self._outcome(work)
        if isinstance(plan, Stopped):
            summary: Json = {"state": "cancelled"}
        elif isinstance(plan, Exception):
            summary = _refused(plan)
        else:
            self._trajectories.publish(trajectory_message(plan.trajectory))
            summary = summary_of(plan.answer)
        summary["goal_stamp"] = work.stamp
        self._tell(summary)
        return summary

    def _outcome(self, work: _Work) -> Outcome:
        try:
            return self._planned(work)
        except (Stopped, DeclaredError) as error:
            return error
        except Exception as error:
            self.get_logger().error(f"A defect of joulepath: {error!r}")
            return error

    def _planned(self, work: _Work) -> Plan:
        if work.stopped.is_set():
            raise Stopped
        own = self._parameters
        if self._planner is None and own.url:
            # a service may start later than the node
            self._planner = RemotePlanner(
                Client(own.url, own.api_key or None), own.robot, own.prefix
            )
        if self._planner is None:
            raise refusal(
                ("robot_description",),
                "No robot is known yet: publish its URDF on robot_description, or set the "
                "parameter `robot`.",
            )
        fields = work.fields()
        if "start" not in fields:
            fields["start"] = {"q": self._current()}
        body = own.request() | fields
        if self.scene is not None:
            body["scene"] = self.scene.added_to(body.get("scene"))
        return self._planner.plan(body, work.stopped.is_set)

    def _current(self) -> list[float]:
        if self.joint_state is None:
            raise refusal(
                ("joint_states",),
                "No joint state has arrived: publish it on joint_states, or remap this topic.",
            )
        return self._positions("joint_states", self.joint_state)

    def _positions(self, topic: str, message: JointState) -> list[float]:
        """The positions [rad] of the robot's joints; raises InvalidRequest."""
        names = JointNames(self.joints, self._parameters.prefix)
        return names.positions(topic, message.name, message.position)

    def _tell(self, summary: Json) -> None:
        self._summaries.publish(String(data=_text(summary)))

    def refuse(self, error: DeclaredError) -> None:
        """Publish a problem that belongs to no goal."""
        self.get_logger().error(str(error))
        self._tell(_refused(error))


def _refused(error: Exception) -> Json:
    if isinstance(error, ServiceUnreachable):
        # no answer of a service, and so none of its types of problems
        return {"state": "refused", "problem": {"type": UNREACHABLE, "detail": str(error)}}
    document = getattr(error, "document", None) or problem_of(error, "")
    return {"state": "refused", "problem": document}


def _text(summary: Json) -> str:
    # problems have data of the library's own classes
    return json_document(summary).decode()


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
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            node.close()
        rclpy.try_shutdown()
