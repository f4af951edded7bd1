"""Boxes of joint positions narrowed to a pose, without a loss of any configuration of the pose."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, ConeOrientedPose
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.covers.wrist_boxes import WristBoxes
from joulepath.optimizer.kinematics.covers.wrist_geometry import WristGeometry
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.chains import serial_chain
from tests.optimizer.moves import GOAL, HOME, PAYLOAD, ROBOT, TILTED, problem
from tests.selection import long_but

TOOL = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.9), np.array([0.03, -0.02, 0.15])).homogeneous
# largest angle of a configuration outside its box: angles are rounded, not bounded [rad]
ROUNDING = 1e-12
ARMS: dict[str, Arm] = {
    "bare": Arm(robot=ROBOT),
    "tool": Arm(robot=ROBOT, T_flange_tcp=TOOL, payload=PAYLOAD, gravity=TILTED),
    "seven joints": Arm(robot=serial_chain(7)),
    "four joints": Arm(robot=serial_chain(4)),
}


def reached(
    rng: np.random.Generator, arm: Arm, half_angle: float
) -> tuple[Array, ConeOrientedPose]:
    """A configuration and a goal it reaches, often at the edge of the goal's cone."""
    q = rng.uniform(-np.pi, np.pi, arm.robot.nq)
    q[rng.random(len(q)) < 0.2] = 0.0  # stretched and aligned, as singular ones are
    T = tcp_pose(arm, q)
    axis = rng.normal(size=3) if rng.random() < 0.5 else np.array([0.0, 0.0, 1.0])
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, rng.normal(size=3))
    turn = pin.exp3(across / np.linalg.norm(across) * half_angle * rng.choice([0.0, 0.5, 1.0]))
    return q, ConeOrientedPose(T[:3, 3], axis, T[:3, :3] @ turn @ axis, half_angle)


def boxes_around(rng: np.random.Generator, q: Array, count: int) -> tuple[Array, Array]:
    """Random boxes around q, from narrow ones to the whole range, some with q in a corner."""
    half = np.minimum(10 ** rng.uniform(-4, 0.6, (count, len(q))), np.pi)
    within = np.where(
        rng.random(half.shape) < 0.2,
        np.sign(rng.normal(size=half.shape)),
        rng.uniform(-1, 1, half.shape),
    )
    return q + half * within, half


def lost(q: Array, centre: Array, half: Array, held: Array) -> Array:
    """Mask (b,) of the boxes without q, up to full turns."""
    return np.asarray(~(held & (np.abs(wrapped(q - centre)) <= half + ROUNDING).all(axis=1)))


def wrist_boxes(arm: Arm, pose: ConeOrientedPose) -> WristBoxes:
    """Wrist boxes of an arm with at least four joints."""
    geometry = WristGeometry.of(arm)
    assert geometry is not None
    return WristBoxes(geometry, pose)


@pytest.mark.parametrize("count", long_but((30,), (30, 60)))
@pytest.mark.parametrize("kind", [PoseBoxes, wrist_boxes])
@pytest.mark.parametrize("half_angle", long_but([0.0, 0.3], [0.0, 0.02, 0.3, 1.6, np.pi]))
@pytest.mark.parametrize("name", ARMS)
def test_configurations_of_the_pose_stay_in_their_box(
    name: str, half_angle: float, kind: Any, count: int
) -> None:
    rng = np.random.default_rng(7)
    for _ in range(count):
        q, pose = reached(rng, ARMS[name], half_angle)
        centre, half = boxes_around(rng, q, 64)
        if kind is wrist_boxes:
            # The second joint of a wrist is never wider than half a turn.
            half[:, -2] = np.minimum(half[:, -2], np.pi / 2)
            centre[:, -2] = q[-2] + np.clip(centre[:, -2] - q[-2], -half[:, -2], half[:, -2])
        assert not lost(q, *kind(ARMS[name], pose).narrowed(centre, half)).any()
        narrow, sides, held = kind(ARMS[name], pose).narrowed(centre, half)
        assert (sides <= half + ROUNDING).all() and held.all()
        assert not lost(q, *kind(ARMS[name], pose).narrowed(narrow, sides)).any()


def test_small_boxes_shrink_onto_the_configurations_of_the_pose() -> None:
    """Small boxes shrink onto the configurations of a pose with a free turn about an axis.

    At a known angle of the turn, narrowing determines the other joints.
    """
    rng, arm = np.random.default_rng(3), Arm(robot=ROBOT)
    q = HOME + rng.uniform(-0.3, 0.3, 6)
    T = tcp_pose(arm, q)
    boxes = PoseBoxes(arm, ConeOrientedPose(T[:3, 3], np.array([0.0, 0.0, 1.0]), T[:3, 2], 0.0))
    centre, half = q[None] + 0.01, np.full((1, 6), 0.02)
    for _ in range(6):
        centre, half, held = boxes.narrowed(centre, half)
        assert held.all()
    assert half[0, :5].max() < 4e-3  # a fifth of what it was, and the last joint is free


def test_boxes_that_cannot_reach_the_pose_are_empty() -> None:
    arm = Arm(robot=ROBOT)
    T = tcp_pose(arm, GOAL)
    pose = ConeOrientedPose(T[:3, 3] + [0.0, 0.0, 0.1], np.array([0.0, 0.0, 1.0]), T[:3, 2], 0.1)
    assert not PoseBoxes(arm, pose).narrowed(GOAL[None], np.full((1, 6), 0.02))[2].any()
    geometry = WristGeometry.of(arm)
    assert geometry is not None
    assert (
        not WristBoxes(geometry, pose)
        .narrowed(GOAL[None], np.append(np.full(3, 0.01), np.full(3, 0.3))[None])[2]
        .any()
    )


@pytest.mark.parametrize("name", ARMS)
def test_no_configuration_in_a_box_has_less_potential_energy(name: str) -> None:
    rng, arm = np.random.default_rng(5), ARMS[name]
    made = PreparedProblem.of(
        replace(problem(), arm=arm, start=np.zeros(arm.robot.nq), goal=np.ones(arm.robot.nq))
    )
    boxes = PoseBoxes(arm, ConeOrientedPose(np.array([0.4, 0.1, 0.3])))
    assert rigid_body_model(arm).nq == arm.robot.nq
    centre = rng.uniform(-np.pi, np.pi, (40, arm.robot.nq))
    half = 10 ** rng.uniform(-3, 0.5, centre.shape)
    least = boxes.least_potential(centre, half)
    for _ in range(40):
        within = rng.choice([-1.0, 1.0, 0.3], centre.shape)
        potential = np.array([made.potential(q) for q in centre + half * within])
        assert (potential >= least - 1e-9).all()
    # The bound of a point is its potential energy.
    assert boxes.least_potential(centre, np.zeros_like(centre)) == pytest.approx(
        np.array([made.potential(q) for q in centre]), abs=1e-9
    )
