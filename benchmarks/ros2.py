"""Time that the ROS 2 node adds to the library. The exit code is 1 if the median is above MOST.

    build/ros2/bin/python -m benchmarks.ros2 --count 40

A node in a process of its own plans random motions by its service `~/plan`, and the library plans
the same motions here, in turn: the differences of the times are those of one moment. Set
ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST on a machine that shares its network.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from benchmarks.command import parser, write_json
from benchmarks.statistics import Spread
from joulepath.models.registry import load_robot
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem

# greatest median of the time that the node adds [s]
MOST = 5e-3
ROBOT = "ur5e"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# time after which a goal is published again [s]
AGAIN = 3.0
# greatest displacement of a joint [rad]
FAR = 1.5


class Caller(Node):
    """A client of the node."""

    def __init__(self) -> None:
        super().__init__("caller")
        self.stamp = 0
        """Stamp of the last goal whose summary arrived [s]."""
        self.goals = self.create_publisher(JointState, "joulepath/goal_joints", 10)
        self.states = self.create_publisher(JointState, "joint_states", 10)
        self.plan = self.create_client(Trigger, "joulepath/plan")
        self.create_subscription(String, "joulepath/summary", self._on_summary, LATCHED)
        self.executor_of_own = SingleThreadedExecutor()
        self.executor_of_own.add_node(self)

    def _on_summary(self, message: String) -> None:
        summary = json.loads(message.data)
        if summary["state"] != "cancelled":
            self.stamp = summary["goal_stamp"]["sec"]

    def stand_at(self, names: list[str], q: np.ndarray, goal: np.ndarray) -> None:
        """Publish a joint state and a goal until the node has planned to it; before the node and
        this client have found each other, messages are lost.
        """
        state = JointState(name=names, position=q.tolist())
        aim = JointState(name=names, position=goal.tolist())
        aim.header.stamp.sec = self.stamp + 1
        again = 0.0
        while self.stamp != aim.header.stamp.sec:
            # a goal ends the plan of the one before it
            if time.monotonic() > again:
                self.states.publish(state)
                self.goals.publish(aim)
                again = time.monotonic() + AGAIN
            self.executor_of_own.spin_once(timeout_sec=AGAIN)

    def planned(self) -> tuple[float, dict[str, object]]:
        """Time of one plan by the service [s], and its summary."""
        began = time.perf_counter()
        future = self.plan.call_async(Trigger.Request())
        self.executor_of_own.spin_until_future_complete(future)
        wall = time.perf_counter() - began
        answer: dict[str, object] = json.loads(future.result().message)
        return wall, answer


def main() -> int:
    """Prints the medians."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=40, help="motions (%(default)s)")
    given = arguments.parse_args()
    robot, rng = load_robot(ROBOT), np.random.default_rng(given.seed)
    names, arm = list(robot.joint_names), Arm(robot=robot)
    command = [sys.executable, "-m", "joulepath.app.cli", "ros2", "--ros-args", "-p"]
    node = subprocess.Popen([*command, f"robot:={ROBOT}"])
    rclpy.init()
    caller = Caller()
    added, alone = list[float](), list[float]()
    try:
        caller.plan.wait_for_service()
        while len(added) < given.count:
            q = rng.uniform(-2.0, 2.0, robot.nq)
            goal = q + rng.uniform(-FAR, FAR, robot.nq)
            caller.stand_at(names, q, goal)
            wall, summary = caller.planned()
            if summary["state"] != "planned":
                continue
            began = time.perf_counter()
            optimize(Problem(arm=arm, start=q, goal=goal), progress=False)
            alone.append(time.perf_counter() - began)
            added.append(wall - alone[-1])
    finally:
        node.terminate()
        node.wait()
        rclpy.try_shutdown()
    for title, values in (("library alone", alone), ("added by the node", added)):
        print(f"{title:18s} {Spread.of(values).times(1000).formatted(' ms', 1)}")
    write_json(given.json, {"alone": alone, "added": added})
    return 1 if np.median(added) > MOST else 0


if __name__ == "__main__":
    sys.exit(main())
