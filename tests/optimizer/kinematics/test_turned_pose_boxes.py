"""Boxes of a pose turned about the tool's axis hold every configuration that reaches it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import Arm, ConeOrientedPose, Pose, Robot, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.covers.turned_pose_boxes import BRANCHES, TurnedPose
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.tcp import flange_pose, tcp_pose
from tests.optimizer.kinematics.axis_patterns import redrawn, robot_of, shifted

# largest error of a solution of the closed form next to a singularity [rad]
EXACT = 1e-9


def _drawn() -> Robot:
    """UR5e with offsets at the first and the fourth axis, in another convention."""
    return robot_of(redrawn(shifted(-0.05, 0.04), np.random.default_rng(8))[0])


ARMS = {"ur5e": load_robot("ur5e"), "ur10e": load_robot("ur10e"), "drawn": _drawn()}


def _singular(rng: np.random.Generator, kind: str) -> Array:
    """Configuration (6,) [rad] of the closed form at a singularity, or next to one."""
    q = rng.uniform(-np.pi, np.pi, 6)
    if kind == "shoulder":
        # The last axis' origin is as close to the first axis as possible.
        q[1:4] = [-np.pi / 2, 0.0, rng.choice([0.0, np.pi])]
    if kind != "any":
        q[{"elbow": 2, "wrist": 4, "beside the wrist": 4, "shoulder": 2}[kind]] = 1e-6 * (
            kind == "beside the wrist"
        )
    return q


@pytest.mark.parametrize("kind", ["any", "elbow", "wrist", "beside the wrist", "shoulder"])
@pytest.mark.parametrize("robot", ARMS, ids=list(ARMS))
def test_no_configuration_is_outside_the_boxes(robot: str, kind: str) -> None:
    """The boxes contain all configurations, for any tool, tool axis and drawing of the arm."""
    for seed in range(6):
        rng = np.random.default_rng([seed, len(kind)])
        aligned = seed % 2 == 0
        quaternion = [0, 0, 0, 1] if aligned else Rotation.random(random_state=seed).as_quat()
        T_flange_tcp = Pose.from_quaternion(rng.uniform(-0.2, 0.2, 3), quaternion).T
        arm = Arm(robot=ARMS[robot], T_flange_tcp=T_flange_tcp)
        form = URClosedForm.of(arm.robot.model)
        assert form is not None
        q = form.drawing.file_within_turn(_singular(rng, kind))
        T, axis = tcp_pose(arm, q), np.array([0.0, 0.0, 1.0]) if aligned else rng.normal(size=3)
        given = Pose(T)
        pose = ConeOrientedPose.about(given, axis)
        turned = TurnedPose.of(arm, pose, given)
        assert turned is not None
        angles = np.append(rng.uniform(-np.pi, np.pi, 12), 0.0)
        width = float(rng.choice([0.3, 0.05, 1e-3]))
        # Angles anywhere in their cell, including its edges.
        cells = angles + width * np.append(rng.uniform(-1, 1, 11), [1.0, -1.0])
        reached = 0
        for angle, cell in zip(angles, cells, strict=True):
            centre, half, held = turned.boxes(
                np.full(BRANCHES, cell), np.full(BRANCHES, width), np.arange(BRANCHES)
            )
            at = T.copy()
            at[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(angle * pose.axis).as_matrix()
            solutions, _ = turned.form.solve(flange_pose(at, arm.T_flange_tcp))
            for found in [*solutions, *([q] if angle == 0.0 else [])]:
                inside = held & (np.abs(wrapped(found - centre)) <= half + EXACT).all(axis=1)
                assert inside.any()
                reached += 1
        assert reached


def test_small_cells_have_small_boxes() -> None:
    """Away from singularities, boxes shrink with the cell."""
    arm = Arm(
        robot=load_robot("ur5e"),
        T_flange_tcp=Pose.from_quaternion([0.15, 0.0, 0.1], [0, 0, 0, 1]).T,
    )
    given = Pose.from_quaternion([0.5, -0.2, 0.2], [0.0, 1.0, 0.0, 0.0])
    turned = TurnedPose.of(arm, ConeOrientedPose.about(given, np.array([0.0, 0.0, 1.0])), given)
    assert turned is not None
    for width in (1e-2, 1e-3, 1e-4):
        _, half, held = turned.boxes(
            np.zeros(BRANCHES), np.full(BRANCHES, width), np.arange(BRANCHES)
        )
        assert held.any() and half[held].max() < 20 * width


def test_other_arms_and_freedoms_have_none() -> None:
    arm = Arm(robot=load_robot("ur5e"))
    assert TurnedPose.of(arm, ConeOrientedPose(np.array([0.4, 0.0, 0.3]), half_angle=0.2)) is None
    assert (
        TurnedPose.of(
            Arm(robot=load_robot("iiwa14")), ConeOrientedPose(np.zeros(3), half_angle=0.0)
        )
        is None
    )
