"""Where the TCP is, and poses that differ from it by a rotation about its own origin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from models.robot import Array, Robot
from optimizer.problem.arm import Arm


def T_last_tcp(arm: Arm) -> Array:
    """Pose (4, 4) of the TCP in the frame of the last link."""
    return np.asarray(arm.robot.T_last_flange @ arm.T_flange_tcp)


def turned_poses(robot: Robot, T_flange_tcp: Array, q: Array, rotvecs: Sequence[Array]) -> list[tuple[Array, Array]]:
    """Position (3,) [m] and quaternion x, y, z, w (4,), in the base frame, of the TCP at q (nq,) after each turn.

    `T_flange_tcp` is (4, 4); each turn is a rotation vector (3,) [rad] in the TCP frame, about the TCP's origin: the
    position is the same for all.
    """
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.asarray(q, dtype=float))
    T = data.oMf[robot.model.getFrameId("flange")].homogeneous @ T_flange_tcp
    orientation = Rotation.from_matrix(T[:3, :3])
    return [(T[:3, 3].copy(), (orientation * Rotation.from_rotvec(turn)).as_quat()) for turn in rotvecs]
