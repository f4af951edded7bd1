"""Joint limits from torque, attacked with Pinocchio's inverse dynamics."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import yaml

from joulepath import (
    Arm,
    InvalidProblem,
    JointLimits,
    NoJointLimits,
    Payload,
    joint_limits,
    load_robot,
    robot_names,
)
from joulepath.models.own_arm.description import Description
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.joint_limits.joint_limits import joint_limits_along
from joulepath.optimizer.joint_limits.posture_set import PostureSet
from joulepath.optimizer.joint_limits.posture_terms import PostureTerms
from joulepath.optimizer.joint_limits.torque_cover import TorqueCover
from joulepath.optimizer.joint_limits.torque_load import Rates, TorqueLoad, greatest_torques
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.motion.joined import spline_through
from joulepath.optimizer.motion.spline import sample
from tests.by_pinocchio import torques_of
from tests.models.own_arm.arms import robot
from tests.models.own_arm.palletiser import ACROSS, UP, joint, link
from tests.models.own_arm.palletiser import description as palletiser
from tests.optimizer.joint_limits.attack import torque_ratios, worst_ratio
from tests.refusals import refusal_of
from tests.selection import long_but

HOME = np.array([0, -1.6, 1.6, -1.6, -1.6, 0])
REST = np.zeros((2, 6))
PENDULUM = (
    '<robot name="pendulum"><link name="base"/>'
    + link("bar", 8.0, "0.2 0 0.1")
    + joint("turn", "base bar", "0 0 0.3", ACROSS, "-2.9 2.9")
    + "</robot>"
)
ROUNDING = 1e-9
"""Rounding of torques [N·m], which are below 1e3 N·m."""
HEAVY = {"gen3": 0.25, "ur20": 0.5, "xarm7": 0.25}
"""Share of the rated payload that robots carry in all postures, if they cannot carry it all."""


def loaded(name: str, share: float = 1.0, com: tuple[float, float, float] = (0, 0, 0)) -> Arm:
    robot = load_robot(name)
    mass = share * robot.rated_payload
    return Arm(robot=robot, payload=Payload(mass, np.array(com), 0.01 * mass * np.eye(3)))


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_the_terms_give_the_torques_of_pinocchio(name: str) -> None:
    arm = loaded(name, com=(0.03, 0.02, 0.1))
    model, random = rigid_body_model(arm), np.random.default_rng(0)
    q, v, a = random.uniform(-3, 3, (3, 20, arm.robot.nq))
    terms = PostureTerms.of(ChainDerivatives.of(arm), q)
    bodies = (
        np.einsum("nij,nj->ni", terms.inertia, a)
        + np.einsum("nijk,nj,nk->ni", terms.velocity, v, v)
        + terms.gravity
    )
    expected = torques_of(model, q, v, a)
    assert bodies + arm.drives.rotor_inertia * a == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize(
    ("name", "half"), long_but([("panda", 0.4)], [("ur5e", 0.4), ("panda", 0.4), ("ur10e", 0.1)])
)
def test_the_bound_of_a_box_holds_inside_it(name: str, half: float) -> None:
    """The bound is also close to the maximum: a box is not refused without a reason."""
    arm = loaded(name, com=(0.03, 0.02, 0.1))
    limits = arm.active_limits
    rates, nq = Rates(limits.v_max / 2, limits.a_max / 4), arm.robot.nq
    random = np.random.default_rng(0)
    boxes = PostureSet(random.uniform(-3, 3, (12, nq)), np.full((12, nq), half))
    chain, unit = ChainDerivatives.of(arm), limits.tau_max
    cover = TorqueCover(chain, rates, np.zeros(nq), unit, boxes, np.inf, 0)
    bounds = -cover.first().value
    for k in range(len(bounds)):
        inside = PostureSet(boxes.centre[k : k + 1], boxes.half[k : k + 1]).draw(2000)
        found = greatest_torques(PostureTerms.of(chain, inside), rates) / unit
        assert found.max() <= bounds[k] <= 20 * found.max()


def test_full_speed_is_refused_with_a_posture() -> None:
    arm = loaded("ur5e")
    most, load = arm.active_limits, TorqueLoad(arm)
    rates, unit = Rates(most.v_max, most.a_max), most.tau_max
    allowed = load.allowed(rates)
    cover = TorqueCover(
        load.chains[0], rates, allowed, unit, PostureSet.of_ranges(arm), 0.0, 100_000
    )
    assert not cover.holds()
    found = greatest_torques(PostureTerms.of(load.chains[0], cover.violations), rates)
    assert (found > allowed).any(axis=1).all()


@cache
def limits_of_ur5e() -> tuple[Arm, JointLimits]:
    """A loaded arm and its joint limits, for several tests."""
    arm = loaded("ur5e", com=(0, 0, 0.1))
    return arm, joint_limits(arm)


def attacked(arm: Arm, found: JointLimits) -> float:
    limits = arm.active_limits
    return worst_ratio(arm, Rates(found.v, found.a), limits.q_min, limits.q_max)


def test_no_attack_exceeds_a_torque_limit() -> None:
    """One attack comes close to a limit, so the joint limits are not needlessly low."""
    arm, found = limits_of_ur5e()
    assert 0.9 < attacked(arm, found) <= 1
    most = arm.active_limits
    assert (found.v <= most.v_max).all() and (found.a <= most.a_max).all()
    assert (found.v > 0.1 * most.v_max).all() and (found.a > 0.01 * most.a_max).all()


@pytest.mark.long
@pytest.mark.parametrize("name", robot_names())
def test_no_attack_exceeds_a_torque_limit_of_any_robot(name: str) -> None:
    arm = loaded(name, HEAVY.get(name, 1.0))
    found = joint_limits(arm)
    ratio = attacked(arm, found)
    print(f"{name}: spare {found.spare:g}, v {found.v}, a {found.a}, worst ratio {ratio:.4f}")
    assert ratio <= 1


@pytest.mark.parametrize("name", HEAVY)
def test_a_payload_that_gravity_makes_too_heavy(name: str) -> None:
    with pytest.raises(NoJointLimits) as raised:
        joint_limits(loaded(name))
    assert raised.value.torque > raised.value.limit and raised.value.joint in str(raised.value)


def test_the_postures_of_a_motion_hold_more() -> None:
    arm, anywhere = limits_of_ur5e()
    start, goal = np.array([0, -1.6, 1.6, -1.6, -1.6, 0]), np.array([1, -1.2, 1.2, -1.6, -1.2, 0.5])
    spline = spline_through(np.array([0.0, 1.5]), np.stack([start, goal]), REST, REST)
    here = joint_limits_along([(spline, arm)])
    assert (here.v >= anywhere.v).all() and here.a[1] > 1.5 * anywhere.a[1]
    rates = Rates(here.v, here.a)
    path = sample(spline, np.linspace(0, 1.5, 40))[0]
    assert 0.8 < max(torque_ratios(arm, q, rates).max() for q in path) <= 1


def test_the_file_of_moveit() -> None:
    arm = loaded("ur5e", 0.5)
    found = replace(joint_limits(arm), j=np.array([1.0, 1.0, np.inf, 1.0, 1.0, 1.0]))
    limits = yaml.safe_load(found.to_yaml("left_"))["joint_limits"]
    assert list(limits) == ["left_" + name for name in arm.robot.joint_names]
    assert limits["left_elbow_joint"] == {
        "has_velocity_limits": True,
        "max_velocity": found.v[2],
        "has_acceleration_limits": True,
        "max_acceleration": found.a[2],
        "has_jerk_limits": False,
    }
    head = found.to_yaml().partition("joint_limits:\n")[0]
    assert "up to 2.5 kg" in head and "moments of inertia (0.025, 0.025, 0.025)" in head
    assert "gravity (0, 0, -9.81) m/s²" in head


@pytest.mark.long
def test_the_file_of_several_moves_claims_no_payload_for_all() -> None:
    spline = spline_through(np.array([0.0, 1.5]), np.array([HOME, HOME + 0.3]), REST, REST)
    moves = [(spline, loaded("ur5e", share)) for share in (1.0, 0.0)]
    head = joint_limits_along(moves).to_yaml()
    assert "payloads of each move up to its own" in head and "5 kg" not in head


def test_a_single_joint_is_limited_by_the_torque_of_a_pendulum() -> None:
    """In all postures of a horizontal axis, the torque is I a + m g r, without friction and at any
    speed.
    """
    bar = robot(Description(urdf=PENDULUM, tip="bar", acceleration=500.0, payload=1.0))
    arm = Arm(robot=bar)
    found = joint_limits(arm)
    (a,), (ratio,) = found.a, torque_ratios(arm, np.array([0.0]), Rates(found.v, found.a))
    assert 0 < a < 500.0 and 0.8 < ratio <= 1


def test_an_arm_of_eight_joints_is_refused() -> None:
    links = "".join(
        link(f"l{k}", 2.0, "0.02 0 0.1")
        + joint(f"j{k}", f"l{k - 1} l{k}", "0 0 0.2", UP if k % 2 else ACROSS, "-2.5 2.5")
        for k in range(1, 9)
    )
    urdf = f'<robot name="snake"><link name="l0"/>{links}</robot>'
    snake = robot(Description(urdf=urdf, tip="l8", acceleration=8.0, payload=1.0))
    with pytest.raises(InvalidProblem, match="8 joints"):
        joint_limits(Arm(robot=snake))


def test_an_arm_with_followers_is_refused() -> None:
    with refusal_of("robot", match="follow others"):
        joint_limits(Arm(robot=robot(palletiser())))
