"""A pose of the TCP in the base frame, from a matrix or any usual form of an orientation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import frozen, rigid_transform

QUATERNION_TOLERANCE = 1e-3
"""Greatest deviation of a quaternion's norm from 1, as after rounding to three decimals."""


@dataclass(frozen=True)
class Pose:
    """Pose of the TCP in the base frame.

    Attributes:
        T: homogeneous matrix T_base_tcp, shape (4, 4), position in m.

    Raises:
        InvalidProblem: `T` is no rigid transform.
    """

    T: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "T", rigid_transform(self.T, "pose"))

    @classmethod
    def from_rotation(cls, position: object, R: object) -> Pose:
        """From a position (3,) [m] and a rotation matrix (3, 3). Raises InvalidProblem."""
        T = np.eye(4)
        T[:3, :3] = frozen(R, (3, 3), "pose.rotation")
        T[:3, 3] = frozen(position, (3,), "pose.position")
        return cls(T)

    @classmethod
    def from_quaternion(cls, position: object, quaternion: object) -> Pose:
        """From a position (3,) [m] and a unit quaternion x, y, z, w (4,). Raises InvalidProblem."""
        return cls.from_rotation(position, rotation_from_quaternion(quaternion))

    @classmethod
    def from_rpy(cls, position: object, rpy: object) -> Pose:
        """From a position (3,) [m] and roll, pitch, yaw (3,) [rad] about fixed axes. Raises
        InvalidProblem.
        """
        return cls.from_rotation(position, rotation_from_rpy(rpy))

    @classmethod
    def from_rotvec(cls, position: object, rotvec: object) -> Pose:
        """From a position (3,) [m] and a rotation vector (3,) [rad]. Raises InvalidProblem."""
        return cls.from_rotation(position, rotation_from_rotvec(rotvec))


def rotation_from_quaternion(quaternion: object) -> Array:
    """Rotation matrix (3, 3) of a quaternion x, y, z, w (4,), which is normalised.

    Raises:
        InvalidProblem: the norm differs from 1 by more than QUATERNION_TOLERANCE.
    """
    field = "pose.quaternion"
    given = frozen(quaternion, (4,), field)
    norm = float(np.linalg.norm(given))
    if abs(norm - 1) > QUATERNION_TOLERANCE:
        raise InvalidProblem(
            field, f"{field} must have norm 1, to within {QUATERNION_TOLERANCE:g}."
        )
    x, y, z, w = given / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_rpy(rpy: object) -> Array:
    """Rotation matrix (3, 3) Rz(yaw) Ry(pitch) Rx(roll) of angles (3,) [rad] about the fixed axes.

    Raises:
        InvalidProblem: the angles are malformed.
    """
    angles = frozen(rpy, (3,), "pose.rpy")
    roll, pitch, yaw = (
        rotation_from_rotvec(angle * axis) for angle, axis in zip(angles, np.eye(3), strict=True)
    )
    return np.asarray(yaw @ pitch @ roll)


def rotation_from_rotvec(rotvec: object) -> Array:
    """Rotation matrix (3, 3) of a rotation vector (3,) [rad]: unit axis times angle.

    Raises:
        InvalidProblem: the vector is malformed.
    """
    vector = frozen(rotvec, (3,), "pose.rotvec")
    angle = float(np.linalg.norm(vector))
    # sinc keeps the quaternion exact through zero
    half = 0.5 * vector * np.sinc(0.5 * angle / np.pi)
    return rotation_from_quaternion([*half, np.cos(0.5 * angle)])
