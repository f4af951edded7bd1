"""A URDF may lack parts or contain more than an arm; one answer lists all of its problems."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.mesh_files import surface
from tests.models.own_arm.arms import PLAIN, RICH, RICH_ARM, SHAPE, robot
from tests.optimizer.kinematics.six_joints import flange

FINGERS = """
  <joint name="finger" type="prismatic"><parent link="tool"/><child link="left"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.04" effort="20" velocity="0.1"/></joint>
  <link name="left"><inertial><mass value="0.1"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <joint name="opposite" type="prismatic"><parent link="tool"/><child link="right"/>
    <axis xyz="0 -1 0"/><mimic joint="finger"/>
    <limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint>
  <link name="right"/>
</robot>"""
HEAVY = """<link name="right"><inertial><mass value="0.2"/>
  <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>"""
GRIPPING = replace(PLAIN, urdf=PLAIN.urdf.replace("</robot>", FINGERS))
BROKEN = (
    PLAIN.urdf.replace('lower="-2" upper="2"', 'lower="2" upper="2"')
    .replace('lower="-2.5" ', "")
    .replace('<mass value="2"/>', "")
)


@pytest.mark.parametrize(
    "opening",
    [
        "<robot>",
        '<robot name="">',
        '<robot name="example" xmlns="http://www.ros.org">',
        '<robot name="example" xmlns:xacro="http://ros.org/wiki/xacro">'
        '<xacro:property name="length" value="0.4"/><xacro:arg name="side" default="left"/>',
        '<robot name="example"><xacro:macro name="link"><link name="${name}"/></xacro:macro>',
    ],
)
def test_the_arm_is_the_same_without_a_name_and_with_unused_xacro(opening: str) -> None:
    given = replace(PLAIN, urdf=PLAIN.urdf.replace('<robot name="example">', opening))
    assert given.urdf != PLAIN.urdf
    q = np.array([0.3, -0.7])
    assert (flange(robot(given), q) == flange(robot(PLAIN), q)).all()


def test_a_joint_named_flange_and_negative_efforts() -> None:
    """The sign of an effort has no meaning, and a name no other one than in the file."""
    named = PLAIN.urdf.replace('"elbow"', '"flange"').replace('effort="40"', 'effort="-40"')
    found, plain = robot(replace(PLAIN, urdf=named)), robot(PLAIN)
    q = np.array([0.3, -0.7])
    assert (flange(found, q) == flange(plain, q)).all()
    assert found.joint_names[1] == "flange"
    assert (found.limits.tau_max == plain.limits.tau_max).all()


def test_an_expression_in_an_element_without_effect_is_no_xacro() -> None:
    plugin = '<gazebo reference="${a}"><plugin><file>$(find arm)/a.yaml</file></plugin></gazebo>'
    given = replace(PLAIN, urdf=PLAIN.urdf.replace("</robot>", f"{plugin}</robot>"))
    assert own_figures("mine", given)[0] == own_figures("mine", PLAIN)[0]


@pytest.mark.parametrize("used", ["${length}", "$(find arm)"])
def test_xacro_in_use_is_refused(used: str) -> None:
    urdf = PLAIN.urdf.replace('xyz="0 0 0.4"', f'xyz="0 0 {used}"')
    with pytest.raises(InvalidArm, match="This is xacro"):
        own_figures("mine", replace(PLAIN, urdf=urdf))


def test_all_others_are_held_in_one_go() -> None:
    """Every other joint is held at zero, or at its limit nearest to zero."""
    by_name = replace(GRIPPING, locked={"finger": 0.01, "opposite": 0.0})
    others = replace(GRIPPING, locked="others")
    assert own_figures("mine", others) == own_figures("mine", by_name)
    assert own_figures("mine", others)[0] != own_figures("mine", PLAIN)[0]


def test_a_mimic_joint_follows_the_joint_that_is_held() -> None:
    """It is held at multiplier · position + offset, unless it is named itself."""
    mimic = '<mimic joint="finger" multiplier="0.5" offset="0.01"/>'
    gripping = replace(GRIPPING, urdf=GRIPPING.urdf.replace('<mimic joint="finger"/>', mimic))
    heavy = replace(gripping, urdf=gripping.urdf.replace('<link name="right"/>', HEAVY))

    def figures(**locked: float) -> dict[str, Any]:
        return own_figures("mine", replace(heavy, locked=locked))[0]

    assert figures(finger=0.03) == figures(finger=0.03, opposite=0.025)
    assert figures(finger=0.03) != figures(finger=0.03, opposite=0.0)
    others = own_figures("mine", replace(heavy, locked="others"))[0]
    assert others == figures(finger=0.01, opposite=0.015)


def test_the_refusal_names_all_loose_joints_and_how_to_hold_them() -> None:
    with pytest.raises(InvalidArm, match=r"finger, opposite\. Give.*\"others\"") as caught:
        own_figures("mine", GRIPPING)
    assert caught.value.field == "locked"


def test_a_moving_joint_of_the_chain_is_no_other() -> None:
    """A prismatic joint between base and tip is refused all the same."""
    with pytest.raises(InvalidArm, match="'finger' is prismatic"):
        own_figures("mine", replace(RICH_ARM, tip="finger", locked="others"))


def test_all_problems_of_a_file_are_in_one_answer() -> None:
    with pytest.raises(InvalidArm) as caught:
        own_figures("mine", replace(PLAIN, urdf=BROKEN))
    told = [message for _, message in caught.value.problems]
    assert len(told) == 3
    for message, words in zip(
        told,
        ("'shoulder' cannot move", "'elbow' has no <limit>", "'forearm' has a <mass>"),
        strict=True,
    ):
        assert words in message and message in str(caught.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.problems == caught.value.problems and str(again) == str(caught.value)


def test_all_problems_of_the_figures_are_in_one_answer() -> None:
    urdf = PLAIN.urdf.replace('effort="60"', "").replace('velocity="3" effort="40"', "")
    urdf = urdf.replace('<mass value="2"/>', '<mass value="0"/>')
    with pytest.raises(InvalidArm) as caught:
        own_figures("mine", replace(PLAIN, urdf=urdf, payload=-1.0, acceleration=-1.0))
    fields = [field for field, _ in caught.value.problems]
    assert fields == ["urdf", "acceleration", "velocity", "torque", "torque", "payload"]


@pytest.mark.parametrize("description", [PLAIN, RICH_ARM, replace(GRIPPING, locked="others")])
def test_a_plain_description_has_no_problem(description: Description) -> None:
    assert own_figures("mine", description)[0]["kinematics"]


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("box", 'size="0 0 0"'),
        ("sphere", 'radius="0"'),
        ("cylinder", 'radius="0.0" length="0.0"'),
        ("capsule", 'radius="0" length="0"'),
    ],
)
def test_what_has_no_size_is_no_shape(kind: str, sizes: str) -> None:
    """A placeholder of some files. The link has the capsule of a link without shapes."""
    none = PLAIN.urdf.replace(f"<geometry>{SHAPE}</geometry>", "<geometry/>")
    empty = PLAIN.urdf.replace(SHAPE, f"<{kind} {sizes}/>")
    figures, warnings = own_figures("mine", replace(PLAIN, urdf=empty))
    assert figures == own_figures("mine", replace(PLAIN, urdf=none))[0]
    assert f"Unsupported shapes are ignored: {kind} of no size." in warnings


def test_a_mesh_of_a_package_is_found_by_the_end_of_its_path() -> None:
    square = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    meshes = {"arm/meshes/link.obj": square, "arm/meshes/other.obj": square + b"\n"}
    for reference in ("package://arm/meshes/link.obj", "file:///opt/ros/arm/meshes/link.obj"):
        found = surface(meshes, reference)
        assert found is not None and [each.shape for each in found] == [(4, 3), (4, 3)]
    assert RICH.count("<mesh") == 1
