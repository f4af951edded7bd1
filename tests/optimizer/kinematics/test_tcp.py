"""Frame, pose and Jacobian of the TCP against Pinocchio and finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import (
    T_last_tcp,
    flange_pose,
    rotated_poses,
    tcp_jacobian,
    tcp_pose,
)
from joulepath.optimizer.problem.arm import Arm
from tests.optimizer import moves

T_FLANGE_TCP = pin.SE3(
    pin.rpy.rpyToMatrix(0.3, -0.7, 1.1), np.array([0.02, -0.05, 0.18])
).homogeneous
ARM = Arm(robot=moves.ROBOT, T_flange_tcp=T_FLANGE_TCP)
# rounding of a product of eight matrices with entries of about 1
ROUNDING = 1e-14
# step of central differences on values of order one
STEP = 1e-6
# their error: rounding 1e-10, smaller truncation
GRADIENT_TOLERANCE = 1e-8


@pytest.fixture(scope="module")
def configurations() -> Array:
    return np.random.default_rng(9).uniform(-2 * np.pi, 2 * np.pi, (50, 6))


def test_poses_are_pinocchios(configurations: Array) -> None:
    expected = np.array([moves.tcp_pose(q, T_FLANGE_TCP).T for q in configurations])
    assert np.abs(tcp_pose(ARM, configurations) - expected).max() < ROUNDING
    for q, T in zip(configurations, expected, strict=True):
        assert np.abs(tcp_pose(ARM, q) - T).max() < ROUNDING


def test_any_number_of_axes_before_the_joints(configurations: Array) -> None:
    grid = configurations.reshape(5, 10, 6)
    assert tcp_pose(ARM, grid).shape == (5, 10, 4, 4)
    assert (tcp_pose(ARM, grid)[3, 7] == tcp_pose(ARM, configurations[37])).all()


def test_the_frame_is_fixed_to_the_last_link(configurations: Array) -> None:
    data = ARM.robot.model.createData()
    for q in configurations:
        pin.forwardKinematics(ARM.robot.model, data, q)
        assert np.abs(data.oMi[6].homogeneous @ T_last_tcp(ARM) - tcp_pose(ARM, q)).max() < ROUNDING


def test_the_flange_pose_puts_the_tcp_there(configurations: Array) -> None:
    for T in tcp_pose(ARM, configurations):
        assert np.abs(flange_pose(T, T_FLANGE_TCP) @ T_FLANGE_TCP - T).max() < ROUNDING


def test_the_jacobian_is_that_of_finite_differences(configurations: Array) -> None:
    for q in configurations:
        J = tcp_jacobian(ARM, q)
        R = tcp_pose(ARM, q)[:3, :3]
        for j in range(6):
            d = STEP * np.eye(6)[j]
            ahead, behind = tcp_pose(ARM, q + d), tcp_pose(ARM, q - d)
            assert (
                np.abs((ahead - behind)[:3, 3] / (2 * STEP) - J[:3, j]).max() < GRADIENT_TOLERANCE
            )
            spin = (ahead - behind)[:3, :3] / (2 * STEP) @ R.T
            assert np.abs(pin.unSkew(spin) - J[3:, j]).max() < GRADIENT_TOLERANCE


def test_rotated_poses_keep_the_tcp_in_place(configurations: Array) -> None:
    rotvecs = [np.zeros(3), np.array([0.0, 0.0, np.pi]), np.array([0.3, -0.2, 0.1])]
    T = tcp_pose(ARM, configurations[0])
    for rotvec, (position, quaternion) in zip(
        rotvecs, rotated_poses(ARM, configurations[0], rotvecs), strict=True
    ):
        assert (position == T[:3, 3]).all()
        # The rotation is about the TCP's own axes.
        expected = T[:3, :3] @ pin.exp3(rotvec)
        assert np.abs(Rotation.from_quat(quaternion).as_matrix() - expected).max() < ROUNDING
