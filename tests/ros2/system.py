"""The node and a ROS 2 client of it, with separate executors."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from joulepath.app.ros2.node import LATCHED, PlanningNode
from joulepath.app.ros2.planner import Planner

Json = dict[str, Any]

_NUMBERS = count()
PATIENCE = 60.0
"""Time after which a test fails that waits for a message [s]: no limit of what is tested."""


@dataclass
class System:
    """A client of the node, with all its received messages."""

    node: PlanningNode
    client: Node
    executor: SingleThreadedExecutor
    namespace: str
    summaries: list[Json] = field(default_factory=list)
    trajectories: list[JointTrajectory] = field(default_factory=list)

    def __post_init__(self) -> None:
        create, own = self.client.create_publisher, self.namespace + "/joulepath"
        self.states = create(JointState, f"{self.namespace}/joint_states", 10)
        self.goals = create(JointState, f"{own}/goal_joints", 10)
        self.poses = create(PoseStamped, f"{own}/goal_pose", 10)
        self.descriptions = create(String, f"{self.namespace}/robot_description", LATCHED)
        self.client.create_subscription(
            String, f"{own}/summary", lambda each: self.summaries.append(json.loads(each.data)), 10
        )
        self.client.create_subscription(
            JointTrajectory, f"{own}/trajectory", self.trajectories.append, LATCHED
        )
        self._plan = self.client.create_client(Trigger, f"{own}/plan")
        self._cancel = self.client.create_client(Trigger, f"{own}/cancel")
        self.until(
            lambda: all(
                each.get_subscription_count() for each in (self.states, self.goals, self.poses)
            )
        )
        self.until(lambda: self._plan.service_is_ready() and self._cancel.service_is_ready())

    def until(self, done: Callable[[], Any]) -> None:
        """Spin until something is true."""
        end = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < end, "nothing arrived"
            self.executor.spin_once(timeout_sec=0.05)

    def stand(self, names: list[str], q: list[float]) -> None:
        """Publish a joint state, and wait until the node has it."""
        message = JointState(name=names, position=q)
        self.states.publish(message)
        self.until(lambda: self.node.joint_state == message)

    def ask(self, publish: Callable[[], None]) -> Json:
        """The summary after a message."""
        known = len(self.summaries)
        publish()
        self.until(lambda: len(self.summaries) > known)
        return self.summaries[-1]

    def go_to(self, names: list[str], q: list[float]) -> Json:
        """The summary of a plan to joint positions."""
        return self.ask(lambda: self.goals.publish(JointState(name=names, position=q)))

    def plan(self) -> tuple[bool, Json]:
        """The answer of the service `~/plan`."""
        return self._called(self._plan)

    def cancel(self) -> tuple[bool, str]:
        """The answer of the service `~/cancel`."""
        answer = self._response(self._cancel)
        return answer.success, answer.message

    def _called(self, service: Any) -> tuple[bool, Json]:
        answer = self._response(service)
        return answer.success, json.loads(answer.message)

    def _response(self, service: Any) -> Any:
        future = service.call_async(Trigger.Request())
        self.until(future.done)
        return future.result()


@contextmanager
def system(planner: Planner | None = None, **parameters: Any) -> Iterator[System]:
    """A node with these parameters, and a client of it."""
    context = Context()
    rclpy.init(context=context)
    # other systems may be alive, in this process and in others
    namespace = f"/tests_{os.getpid()}_{next(_NUMBERS)}"
    values = [Parameter(name, value=value) for name, value in parameters.items()]
    node = PlanningNode(planner, namespace=namespace, context=context, parameter_overrides=values)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    client = Node("client", context=context)
    own = SingleThreadedExecutor(context=context)
    own.add_node(client)
    try:
        yield System(node, client, own, namespace)
    finally:
        node.close()
        client.destroy_node()
        executor.shutdown()
        own.shutdown()
        rclpy.shutdown(context=context)
