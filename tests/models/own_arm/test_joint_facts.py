"""Figures of a URDF besides its chain: soft limits, friction, limits of URDF 1.2, a tilted base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm
from joulepath.models.own_arm.description import Description, Drives, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.robot import UPRIGHT
from tests.models.own_arm.arms import PLAIN, RICH_ARM, refused, robot

SHOULDER = '<limit lower="-2" upper="2" velocity="3" effort="60"/>'
ELBOW = '<limit lower="-2.5" upper="2.5" velocity="3" effort="40"/>'


def with_parts(shoulder: str, elbow: str) -> Description:
    """The plain arm with elements behind the limits of its joints."""
    assert SHOULDER in PLAIN.urdf and ELBOW in PLAIN.urdf
    urdf = PLAIN.urdf.replace(SHOULDER, SHOULDER + shoulder).replace(ELBOW, ELBOW + elbow)
    return replace(PLAIN, urdf=urdf)


def soft(lower: float, upper: float) -> str:
    limits = f'soft_lower_limit="{lower}" soft_upper_limit="{upper}"'
    return f'<safety_controller {limits} k_velocity="1"/>'


def test_the_tighter_limits_hold() -> None:
    given = with_parts(soft(-1.5, 3.0), soft(-3.0, 3.0))
    limits = robot(given).limits
    assert limits.q_min.tolist() == [-1.5, -2.5] and limits.q_max.tolist() == [2.0, 2.5]
    figures = own_figures("mine", given)[0]["limits"]
    assert "By the soft limits of the URDF: shoulder." in figures["position_min"]["note"]
    assert "soft" not in own_figures("mine", PLAIN)[0]["limits"]["position_min"]["note"]


@pytest.mark.parametrize("part", ['<safety_controller k_velocity="10"/>', soft(0, 0)])
def test_a_safety_controller_without_a_range_limits_nothing(part: str) -> None:
    assert (robot(with_parts(part, "")).limits.q_min == robot(PLAIN).limits.q_min).all()


def test_soft_limits_beyond_the_range_are_refused() -> None:
    for lower, upper in ((2.5, 3.0), (1.0, -1.0)):
        refused("urdf", "'shoulder' cannot move: its soft", with_parts(soft(lower, upper), ""))


def test_one_soft_limit_alone_holds() -> None:
    limits = robot(
        with_parts('<safety_controller soft_upper_limit="1" k_velocity="1"/>', "")
    ).limits
    assert limits.q_min.tolist() == [-2.0, -2.5] and limits.q_max.tolist() == [1.0, 2.5]


def test_friction_of_all_joints_is_taken_with_the_letter_of_the_urdf() -> None:
    given = with_parts(
        '<dynamics friction="4" damping="3"/>', '<dynamics friction="2.5" damping="2"/>'
    )
    figures, warnings = own_figures("mine", given)
    law = figures["friction_laws"]["coulomb_viscous"]
    assert law["coulomb"]["value"] == [4, 2.5] and law["viscous"]["value"] == [3, 2]
    assert {each["trust"] for each in law.values()} == {"C"}
    assert not any("`friction`" in each for each in warnings)
    friction = robot(replace(given, drives=Drives(coulomb=1.0))).friction
    assert friction.coulomb.tolist() == [1, 1] and friction.viscous.tolist() == [3, 2]


def test_friction_of_some_joints_leaves_the_others_to_the_rules() -> None:
    given = with_parts("", '<dynamics friction="2.5" damping="0"/>')
    law, ruled = (
        own_figures("mine", each)[0]["friction_laws"]["coulomb_viscous"] for each in (given, PLAIN)
    )
    assert law["coulomb"]["value"] == [ruled["coulomb"]["value"][0], 2.5]
    assert law["coulomb"]["trust"] == "E" and "URDF: elbow." in law["coulomb"]["note"]
    assert law["viscous"] == ruled["viscous"]


def test_a_simulators_damping_is_remarked() -> None:
    given = with_parts('<dynamics damping="0.01"/>', '<dynamics damping="2"/>')
    (found,) = [each for each in own_figures("mine", given)[1] if "`damping`" in each]
    assert ": shoulder." in found and "drives.viscous" in found
    replaced = replace(given, drives=Drives(viscous=2.0))
    assert not any("`damping`" in each for each in own_figures("mine", replaced)[1])


def with_limits(shoulder: str, elbow: str) -> Description:
    """The plain arm with attributes of URDF 1.2, and without acceleration limits of its own."""
    urdf = PLAIN.urdf.replace('effort="60"', f'effort="60" {shoulder}')
    return replace(
        PLAIN, urdf=urdf.replace('effort="40"', f'effort="40" {elbow}'), acceleration=None
    )


def test_limits_of_urdf_1_2_are_taken() -> None:
    both = 'acceleration="9" deceleration="7" jerk="90"'
    given = with_limits(both, 'acceleration="12" jerk="70"')
    limits = robot(given).limits
    assert limits.a_max.tolist() == [7, 12] and limits.j_max.tolist() == [90, 70]
    limits = robot(replace(given, acceleration=5.0, jerk=50.0)).limits
    assert limits.a_max.tolist() == [5, 5] and limits.j_max.tolist() == [50, 50]


def test_a_missing_acceleration_limit_is_refused() -> None:
    with pytest.raises(InvalidArm, match="'elbow' has no limit `acceleration`") as caught:
        own_figures("mine", with_limits('acceleration="9"', ""))
    assert [field for field, _ in caught.value.problems] == ["acceleration"]


def test_gravity_of_a_tilted_base_is_that_of_the_upright_root() -> None:
    made, (figures, warnings) = robot(RICH_ARM), own_figures("mine", RICH_ARM)
    expected = pin.rpy.rpyToMatrix(0.1, 0.2, 0.3).T @ UPRIGHT
    assert Arm(robot=made).gravity == pytest.approx(expected, abs=1e-12)
    assert figures["kinematics"]["gravity"]["unit"] == "m/s²"
    assert any("tilted against the root link" in each for each in warnings)
    given = np.array([0.0, 0.0, 9.81])
    assert (Arm(robot=made, gravity=given).gravity == given).all()


def test_a_joint_beneath_the_base_turns_gravity_and_is_named() -> None:
    table = (
        '<link name="floor"/><joint name="table" type="revolute"><parent link="floor"/>'
        '<child link="base"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="9" '
        'velocity="1"/></joint></robot>'
    )
    given = replace(PLAIN, urdf=PLAIN.urdf.replace("</robot>", table), base="base")
    assert any("turn, and gravity with them: table." in each for each in own_figures("m", given)[1])
    held = replace(given, locked={"table": 0.5})
    assert not any("with them" in each for each in own_figures("m", held)[1])
    tilted = 9.81 * np.array([0.0, -np.sin(0.5), -np.cos(0.5)])
    assert robot(held).gravity == pytest.approx(tilted)


def test_gravity_of_an_upright_base_is_no_figure() -> None:
    figures, warnings = own_figures("mine", PLAIN)
    assert "gravity" not in figures["kinematics"]
    assert (Arm(robot=robot(PLAIN)).gravity == UPRIGHT).all()
    assert not any("tilted" in each for each in warnings)


def test_elements_without_effect_are_named() -> None:
    urdf = PLAIN.urdf.replace("</robot>", '<transmission name="t"/><gazebo/><gazebo/></robot>')
    assert (
        "Elements of the URDF without effect: gazebo, transmission."
        in own_figures("mine", replace(PLAIN, urdf=urdf))[1]
    )
    inside = with_parts('<calibration rising="0"/>', '<limit lower="0" upper="1"/>')
    assert (
        "Elements of the URDF without effect: calibration, second limit of elbow."
        in own_figures("mine", inside)[1]
    )
    turning, soft_limit = '<axis xyz="0 0 -2"/>', '<safety_controller soft_upper_limit="1"/>'
    endless = replace(RICH_ARM, urdf=RICH_ARM.urdf.replace(turning, turning + soft_limit))
    assert any("soft limits of pan" in each for each in own_figures("mine", endless)[1])
    assert not any("soft limits" in each for each in own_figures("mine", RICH_ARM)[1])
