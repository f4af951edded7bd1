"""Joints that mimic moving joints: laws, limits and refusals, against Pinocchio's own reading."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, mjcf
from joulepath.models.own_arm.description import Drives, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.robot import Array, Robot
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.models.own_arm.arms import RICH, RICH_ARM, robot
from tests.models.own_arm.palletiser import (
    ACROSS,
    KNEE,
    ONE_PARALLELOGRAM,
    PALLETISER,
    PLAIN,
    PLATE,
    description,
    joint,
    link,
)

# rounding of lengths [m], and of torques of some 100 N·m
EXACT = 1e-9

# any axes and any law, as in the wrist of a painting robot
OBLIQUE = replace(
    RICH_ARM,
    urdf=RICH.replace(
        '<origin xyz="0.25 0 0"/>',
        '<origin xyz="0.25 0 0"/><mimic joint="elbow" multiplier="-0.4" offset="0.3"/>',
    ),
)


def states(arm: Robot, count: int = 20) -> tuple[Array, Array, Array]:
    q, v, a = np.random.default_rng(3).normal(size=(3, count, arm.nq))
    return q, v, a


def test_positions_limits_and_names_are_those_of_the_joints_with_motors() -> None:
    arm = robot(description())
    assert arm.joint_names == ("a1", "a2", "a3", "a4")
    assert arm.link_names[1:] == ("swivel", "lower", "knee", "upper", "plate", "tool")
    # m3 limits a3 to -0.2 … 1.3, and m2 leaves the range of a2 unchanged
    np.testing.assert_allclose(arm.limits.q_min, [-2.9, -0.7, -0.2, -3.0])
    np.testing.assert_allclose(arm.limits.q_max, [2.9, 1.5, 1.3, 3.0])
    np.testing.assert_allclose(arm.limits.v_max, [2.0, 2.0, 1.5, 2.0])


def test_a_follower_without_a_range_leaves_that_of_its_leader() -> None:
    for old, new in (('name="m3" type="revolute"', 'name="m3" type="continuous"'), ("-1.2", "0.3")):
        arm = robot(description(PALLETISER.replace(old, new)))
        assert (arm.limits.q_min[2], arm.limits.q_max[2]) == (-0.3, 1.4)


@pytest.mark.parametrize("oblique", [False, True])
def test_torques_and_poses_are_those_of_mimic_joints_in_pinocchio(oblique: bool) -> None:
    """Pinocchio reads the <mimic> of the URDF written by the robot, and of the user's own."""
    given = OBLIQUE if oblique else description()
    arm = robot(given)
    q, v, a = states(arm)
    plant = Plant(Arm(robot=arm))
    for urdf in [urdf_of("mine", arm.figures), *([] if oblique else [PALLETISER])]:
        model = pin.buildModelFromXML(urdf, mimic=True)
        model.armature, model.gravity.linear = arm.drives.rotor_inertia, arm.gravity
        data = model.createData()
        assert model.nq == arm.nq
        expected = [pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)]
        assert np.abs(plant.torques(q, v, a) - expected).max() < EXACT
        tip = model.getFrameId("tool" if urdf is PALLETISER else "flange", pin.FrameType.BODY)
        for T, each in zip(tcp_pose(plant.arm, q), q, strict=True):
            pin.framesForwardKinematics(model, data, each)
            assert np.abs(data.oMf[tip].translation - T[:3, 3]).max() < EXACT


def test_an_arm_with_a_parallelogram_is_a_plain_one_with_other_motors() -> None:
    """Joint 3 of the plain chain turns by a3 - a2, so the torque of a2 is reduced by the torque of
    a3.
    """
    bare = replace(description(), drives=Drives(rotor_inertia=0.0))
    both = [
        Plant(Arm(robot=robot(replace(bare, urdf=urdf)))) for urdf in (ONE_PARALLELOGRAM, PLAIN)
    ]
    q, v, a = states(both[0].arm.robot)
    P = np.eye(4)
    P[2, 1] = -1.0
    ours, plain = both[0].torques(q, v, a), both[1].torques(q @ P.T, v @ P.T, a @ P.T)
    # the tolerance covers the torque of the knee, a link of 1e-6 kg
    assert np.abs(ours - plain @ P).max() < 1e-3
    gain = [both[0].potential(q[1]) - both[0].potential(q[0])]
    gain.append(both[1].potential(P @ q[1]) - both[1].potential(P @ q[0]))
    assert abs(gain[0] - gain[1]) < 1e-3


def test_mujoco_binds_followers_and_has_the_same_torques() -> None:
    arm = robot(description())
    model = mujoco.MjModel.from_xml_string(mjcf(arm))
    data, (q, v, a) = mujoco.MjData(model), states(arm)
    assert model.nu == arm.nq
    expected = Plant(Arm(robot=arm)).torques(q, v, a)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:] = arm.coupling.positions(q[k]), arm.coupling.rates(v[k])
        mujoco.mj_forward(model, data)
        bound = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        assert bound.sum() == 2 and np.abs(data.efc_pos[bound]).max() < EXACT
        data.qacc[:], model.opt.disableflags = arm.coupling.rates(a[k]), 1
        mujoco.mj_inverse(model, data)
        tau = arm.coupling.on_arm(data.qfrc_inverse - model.dof_damping * data.qvel)
        assert np.abs(tau - expected[k]).max() < 1e-3
        model.opt.disableflags = 0


def test_a_follower_of_a_follower_follows_its_leader() -> None:
    law = '<mimic joint="m2" multiplier="-2" offset="0.5"/>'
    arm = robot(description(PALLETISER.replace(PLATE, law)))
    assert arm.coupling.rows[4] == (1, 2.0, 0.5)


def test_rods_beside_the_chain_are_held_and_named() -> None:
    rod = link("rod", 1.0, "0 0 0.3") + joint(
        "crank", "swivel rod", "0 0.1 0", ACROSS, "-1 1", '<mimic joint="a2"/>'
    )
    beside = description(PALLETISER.replace("</robot>", rod + "</robot>"))
    with pytest.raises(InvalidArm, match="'crank' moves a link that is not between"):
        own_figures("mine", beside)
    warnings = own_figures("mine", replace(beside, locked="others"))[1]
    assert any("mimic moving ones: crank" in each for each in warnings)


def test_friction_of_a_follower_is_named() -> None:
    rubbing = PALLETISER.replace(PLATE, PLATE + '<dynamics friction="2" damping="0"/>')
    warnings = own_figures("mine", description(rubbing))[1]
    assert any("<dynamics> has no effect: m3. Give" in each for each in warnings)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ('<mimic joint="m2"/>', "'m2' mimics itself"),
        ('<mimic joint="crank"/>', "'crank', which is not a moving joint between base and tip"),
        ('<mimic joint="a2" multiplier="0"/>', "multiplier of 0"),
        ('<mimic joint="a2" offset="4"/>', "'m2' mimics 'a2', and within its own range"),
        ('<mimic joint="a2" multiplier="one"/>', "multiplier"),
    ],
)
def test_a_law_that_cannot_be_followed_is_refused(law: str, said: str) -> None:
    with pytest.raises(InvalidArm, match=said) as caught:
        own_figures("mine", description(PALLETISER.replace(KNEE, law)))
    assert caught.value.field == "urdf"


def test_a_follower_can_be_held() -> None:
    """The remedy of the refusal: a position in `locked`."""
    held = replace(
        description(PALLETISER.replace(KNEE, '<mimic joint="crank"/>')), locked={"m2": -0.3}
    )
    assert robot(held).joint_names == ("a1", "a2", "a3", "a4")
