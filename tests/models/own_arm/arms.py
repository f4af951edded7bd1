"""Arms of users for tests: a plain one, and one with all features of a URDF."""

from __future__ import annotations

import dataclasses
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from joulepath.app.schemas.examples.own_arm import URDF
from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.robot import Array, Robot

AMPLE = 300.0


PLAIN = Description(urdf=URDF, tip="tool", acceleration=8.0, payload=2.0)


# an arm with all features of a URDF: axes off z, a joint without end, fixed bodies with mass, a
# gripper, a link with a name of this library, a joint named like its link, an undeclared prefix,
# boxes and spheres
RICH = """<robot name="rich">
  <link name="world"/><link name="pedestal"/><link name="elbow"/><link name="hand"/>
  <joint name="fixed_1" type="fixed"><parent link="world"/><child link="pedestal"/>
    <origin xyz="0.1 -0.2 0.5" rpy="0.1 0.2 0.3"/></joint>
  <joint name="pan" type="continuous" tool:note="endless">
    <parent link="pedestal"/><child link="flange_arm"/>
    <origin xyz="0 0 0.1" rpy="0 0 0.4"/><axis xyz="0 0 -2"/>
    <limit effort="40" velocity="2"/></joint>
  <link name="flange_arm">
    <inertial><origin xyz="0.02 0.01 0.1" rpy="0.1 0.5 -0.2"/><mass value="2.5"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0.002" iyy="0.03" iyz="-0.001" izz="0.015"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.3"/></geometry></collision>
  </link>
  <joint name="elbow" type="revolute"><parent link="flange_arm"/><child link="elbow"/>
    <origin xyz="0.05 0 0.3" rpy="1.5707963267948966 0.3 0"/><axis xyz="1 1 0.5"/>
    <limit lower="-2" upper="2.5" effort="30" velocity="2.5"/></joint>
  <joint name="bracket" type="fixed"><parent link="elbow"/><child link="forearm"/>
    <origin xyz="0 0.05 0.1" rpy="0 1.5707963267948966 0"/></joint>
  <link name="forearm"><inertial><origin xyz="0.1 0 0"/><mass value="1.5"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0.1 0 0" rpy="0 1.57 0"/>
    <geometry><cylinder radius="0.04" length="0.2"/></geometry></collision>
    <collision><geometry><mesh filename="forearm.stl"/></geometry></collision></link>
  <joint name="twist" type="revolute"><parent link="forearm"/><child link="wrist"/>
    <origin xyz="0.25 0 0"/><limit lower="-3" upper="3" effort="12" velocity="4"/></joint>
  <link name="wrist"><inertial><mass value="0.8"/>
    <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.001"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <joint name="mount" type="fixed"><parent link="wrist"/><child link="hand"/>
    <origin xyz="0.1 0 0" rpy="0 1.2 0"/></joint>
  <joint name="finger" type="prismatic"><parent link="hand"/><child link="finger"/>
    <origin xyz="0 0 0.08"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.05" effort="20" velocity="0.1"/></joint>
  <link name="finger"><inertial><origin xyz="0 0 0.02"/><mass value="0.1"/>
    <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.00005"/></inertial></link>
</robot>"""


HELD = {"finger": 0.03}


RICH_ARM = Description(
    urdf=RICH, tip="hand", base="pedestal", acceleration=5.0, payload=1.0, locked=HELD
)


def robot(description: Description) -> Robot:
    return robot_of("mine", own_figures("mine", description)[0])


def whole(
    urdf: str, held: dict[str, float], joints: tuple[str, ...]
) -> tuple[pin.Model, Array, Array]:
    """Pinocchio's model of all of a URDF, its neutral position with held joints, and the indices of
    the others.
    """
    root = ElementTree.fromstring(urdf.replace("tool:note", "note"))
    for joint in root.findall("joint"):
        joint.set("name", f"joint_{joint.get('name')}")
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit = joint.find("limit")
            assert limit is not None
            limit.attrib |= {"lower": "-7", "upper": "7"}
    model = pin.buildModelFromXML(ElementTree.tostring(root, encoding="unicode"))
    q = pin.neutral(model)
    for name, position in held.items():
        q[model.joints[model.getJointId(f"joint_{name}")].idx_q] = position
    return (
        model,
        q,
        np.array([model.joints[model.getJointId(f"joint_{name}")].idx_q for name in joints]),
    )


def refused(field: str, words: str, description: Description) -> None:
    with pytest.raises(InvalidArm, match=words) as found:
        own_figures("mine", description)
    assert found.value.field == field


SHAPE = '<cylinder radius="0.05" length="0.3"/>'
"""The collision shape of the plain arm."""


BLOCK = np.array([[x, y, z] for x in (0, 180) for y in (0, 60) for z in (0, 40)], dtype=float)
"""Corners of a block [mm]."""


def obj(points: Any) -> bytes:
    """An OBJ with these corners (n, 3), and a face for every three consecutive corners."""
    lines = [f"v {x} {y} {z}" for x, y, z in np.asarray(points).tolist()]
    return "\n".join(
        [*lines, *(f"f {k} {k + 1} {k + 2}" for k in range(1, len(lines) - 1))]
    ).encode()


def changed(**changes: Any) -> Description:
    """The plain arm with other fields."""
    return dataclasses.replace(PLAIN, **changes)


def meshed(scale: str) -> str:
    """The URDF of the plain arm, with a mesh as its shape."""
    return URDF.replace(SHAPE, f'<mesh filename="link.obj" {scale}/>')
