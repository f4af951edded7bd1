"""Frame, pose and Jacobian of the TCP, and poses rotated about its origin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.jacobians import geometric_jacobian
from joulepath.optimizer.problem.arm import Arm


def T_last_tcp(arm: Arm) -> Array:
    """Pose (4, 4) of the TCP in the frame of the last link."""
    return np.asarray(arm.robot.T_last_flange @ arm.T_flange_tcp)


def flange_pose(T_base_tcp: Array, T_flange_tcp: Array) -> Array:
    """Flange pose (4, 4) in the base frame that puts the TCP at T_base_tcp (4, 4)."""
    R, p = T_flange_tcp[:3, :3], T_flange_tcp[:3, 3]
    T_tcp_flange = np.eye(4)
    T_tcp_flange[:3, :3] = R.T
    T_tcp_flange[:3, 3] = -R.T @ p
    return np.asarray(T_base_tcp @ T_tcp_flange)


def tcp_pose(arm: Arm, q: Array) -> Array:
    """TCP poses T_base_tcp (..., 4, 4) in the base frame at q (..., nq) [rad]."""
    q = np.asarray(q, dtype=float)
    frames = _frames(arm, q.reshape(-1, arm.robot.nq))
    return np.asarray(frames[:, -1] @ T_last_tcp(arm)).reshape(*q.shape[:-1], 4, 4)


def tcp_jacobian(arm: Arm, q: Array) -> Array:
    """Geometric Jacobian (6, nq) of the TCP at q (nq,) [rad], in base axes, linear rows [m]
    first.
    """
    frames = _frames(arm, q[None])
    jacobian = geometric_jacobian(frames, (frames[:, -1] @ T_last_tcp(arm))[:, :3, 3])[0]
    return arm.robot.coupling.on_arm(jacobian)


def _frames(arm: Arm, q: Array) -> Array:
    return link_frames(joint_placements(arm.robot.model), arm.robot.coupling.positions(q))


def rotated_poses(arm: Arm, q: Array, rotvecs: Sequence[Array]) -> list[tuple[Array, Array]]:
    """Poses of the TCP at q (nq,) [rad], rotated about the origin of the TCP.

    Args:
        arm: arm with its TCP.
        q: configuration (nq,) [rad].
        rotvecs: rotation vectors (3,) [rad] in the TCP frame.

    Returns:
        Position (3,) [m] and quaternion x, y, z, w (4,) in the base frame for each rotation. The
        position is the same for all.
    """
    T = tcp_pose(arm, q)
    orientation = Rotation.from_matrix(T[:3, :3])
    return [
        (T[:3, 3].copy(), (orientation * Rotation.from_rotvec(rotvec)).as_quat())
        for rotvec in rotvecs
    ]
