"""Asks the node for a plan, and prints its joules.

joulepath ros2 --ros-args -p robot:=ur5e &
python plan_to_joints.py
"""

from __future__ import annotations

import json
from typing import Any

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
NAMES = [f"{joint}_joint" for joint in JOINTS]
START = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
GOAL = [0.8, -1.2, 1.3, -1.7, -1.57, 0.3]


class Asker(Node):
    """Publishes a goal until the node has answered."""

    def __init__(self) -> None:
        super().__init__("asker")
        self.summary: dict[str, Any] | None = None
        # on a robot, its driver publishes the joint states
        self._states = self.create_publisher(JointState, "joint_states", 10)
        self._goals = self.create_publisher(JointState, "joulepath/goal_joints", 10)
        self.create_subscription(String, "joulepath/summary", self._on_summary, 10)
        self.create_timer(2.0, self._ask)

    def _ask(self) -> None:
        self._states.publish(JointState(name=NAMES, position=START))
        self._goals.publish(JointState(name=NAMES, position=GOAL))

    def _on_summary(self, message: String) -> None:
        summary = json.loads(message.data)
        # messages from before the node knew this publisher of joint states
        if summary["state"] == "planned":
            self.summary = summary


def main() -> None:
    """Prints the energy of the plan, of its bound, and of its baselines."""
    rclpy.init()
    asker = Asker()
    while asker.summary is None:
        rclpy.spin_once(asker)
    plan = asker.summary
    print(
        f"{plan['energy']:.1f} J in {plan['duration']:.2f} s, at least {plan['lower_bound']:.1f} J"
    )
    for baseline in plan["baselines"]:
        if baseline["saving"] is not None:
            print(f"{baseline['saving']:.0%} less than {baseline['name']}")
    rclpy.shutdown()


if __name__ == "__main__":
    main()
