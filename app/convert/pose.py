"""From the schemas of poses to matrices."""

from __future__ import annotations

import math

import numpy as np

from app.schemas.common import Pose, WithQuaternion, WithRotvec, WithRpy
from models.robot import Array


def to_matrix(pose: Pose) -> Array:
    """Homogeneous matrix (4, 4) of a pose."""
    T = np.eye(4)
    T[:3, 3] = pose.position
    T[:3, :3] = to_rotation(pose)
    return T


def to_rotation(orientation: WithQuaternion | WithRpy | WithRotvec) -> Array:
    """Rotation matrix (3, 3) of what holds one of `quaternion`, `rpy` and `rotvec`."""
    if isinstance(orientation, WithQuaternion):
        return _from_quaternion(np.array(orientation.quaternion))
    if isinstance(orientation, WithRpy):
        roll, pitch, yaw = (_from_rotvec(angle * axis) for angle, axis in zip(orientation.rpy, np.eye(3), strict=True))
        return np.asarray(yaw @ pitch @ roll)
    return _from_rotvec(np.array(orientation.rotvec))


def _from_quaternion(quaternion: Array) -> Array:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _from_rotvec(rotvec: Array) -> Array:
    angle = float(np.linalg.norm(rotvec))
    # sinc keeps the quaternion exact through zero
    half = 0.5 * rotvec * np.sinc(0.5 * angle / np.pi)
    return _from_quaternion(np.array([*half, math.cos(0.5 * angle)]))
