"""A URDF for the examples: an arm of two joints."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.files import Example

URDF = """<robot name="example">
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper_arm"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="60"/>
  </joint>
  <link name="upper_arm">
    <inertial><origin xyz="0 0 0.2"/><mass value="3"/>
      <inertia ixx="0.04" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.004"/></inertial>
    <collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05" length="0.3"/></geometry></collision>
  </link>
  <joint name="elbow" type="revolute">
    <parent link="upper_arm"/><child link="forearm"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" velocity="3" effort="40"/>
  </joint>
  <link name="forearm">
    <inertial><origin xyz="0 0 0.15"/><mass value="2"/>
      <inertia ixx="0.016" ixy="0" ixz="0" iyy="0.016" iyz="0" izz="0.002"/></inertial>
  </link>
  <joint name="tool_joint" type="fixed">
    <parent link="forearm"/><child link="tool"/><origin xyz="0 0 0.3"/>
  </joint>
  <link name="tool"/>
</robot>
"""  # noqa: E501
ARM: dict[str, Any] = {"urdf": URDF, "tip": "tool", "acceleration": 8.0, "payload": 2.0}
NEW_ROBOT_EXAMPLES: dict[str, Example] = {
    "two_joints": {"summary": "An arm of two joints", "value": {"name": "my_arm", **ARM}},
}
PUT_EXAMPLES: dict[str, Example] = {
    "makers_figures": {
        "summary": "With friction and idle power from the maker",
        "value": {
            **ARM,
            "source": "maker's data sheet",
            "trust": "A",
            "drives": {
                "coulomb": [3.0, 2.0],
                "viscous": [2.5, 1.5],
                "rotor_inertia": [0.5, 0.3],
                "copper": 0.01,
            },
            "electronics": {"idle_power": 14.0},
        },
    },
}
TITLE_EXAMPLES: Any = {
    "title": {"summary": "Give it a title", "value": {"title": "Palletiser, hall 2"}},
}
"""Beside `PUT_EXAMPLES`, those of the same path."""
