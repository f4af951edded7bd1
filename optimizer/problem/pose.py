"""A pose of the TCP in the base frame, from a matrix or any usual form of an orientation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import frozen, rigid_transform
from joulepath.optimizer.problem.scalars import check_choice

QUATERNION_TOLERANCE = 1e-3
"""Greatest deviation of a quaternion's norm from 1, as after rounding to three decimals."""

MATRIX_TOLERANCE = 1e-3
"""Greatest deviation of a given rotation matrix from the nearest rotation, as after rounding to
three decimals."""

LengthUnit = Literal["m", "mm"]
AngleUnit = Literal["rad", "deg"]
PendantRotation = Literal["rotvec", "rpy", "abc"]


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
    def from_matrix(cls, matrix: object, *, unit: LengthUnit = "m") -> Pose:
        """Pose of a homogeneous matrix, as cameras, CAD and other libraries give it.

        A rotation that was rounded is replaced by the nearest one.

        Args:
            matrix: homogeneous matrix T_base_tcp, shape (4, 4).
            unit: unit of its position.

        Raises:
            InvalidProblem: the matrix is far from a rigid transform, or its last row is not 0, 0,
                0, 1.
        """
        T = frozen(matrix, (4, 4), "pose").copy()
        T[:3, :3] = nearest_rotation(T[:3, :3])
        T[:3, 3] *= metres_per(unit)
        return cls(T)

    @classmethod
    def from_pendant(
        cls,
        values: object,
        *,
        length: LengthUnit = "mm",
        angle: AngleUnit = "rad",
        rotation: PendantRotation = "rotvec",
    ) -> Pose:
        """Pose of the six numbers that a teach pendant shows: X, Y, Z, and an orientation.

        The defaults are those of Universal Robots: millimetres, and RX, RY, RZ as a rotation vector
        in radians, also where the pendant shows joints in degrees. `p[…]` of URScript is in metres:
        `length="m"`. KUKA's A, B, C are `rotation="abc", angle="deg"`; roll, pitch and yaw about
        fixed axes, as of Fanuc's W, P, R, are `rotation="rpy", angle="deg"`.

        Args:
            values: the six numbers in the order of the pendant.
            length: unit of the position.
            angle: unit of the orientation.
            rotation: meaning of the last three numbers.

        Raises:
            InvalidProblem: the values are malformed, or a unit or meaning is unknown.
        """
        given = frozen(values, (6,), "pose")
        position = given[:3] * metres_per(length)
        check_choice("angle", angle, AngleUnit)
        check_choice("rotation", rotation, PendantRotation)
        turns = given[3:] * (np.pi / 180 if angle == "deg" else 1.0)
        match rotation:
            case "rotvec":
                return cls.from_rotvec(position, turns)
            case "rpy":
                return cls.from_rpy(position, turns)
            case _:
                return cls.from_rpy(position, turns[::-1])

    @classmethod
    def from_ros(cls, pose: Any) -> Pose:
        """Pose of a message of ROS, such as `geometry_msgs/Pose`, `PoseStamped` or `Transform`.

        Args:
            pose: the message, or its fields as a dictionary, as of YAML or rosbridge. The frame of
                its header is not read: the pose must be that of the TCP in the frame `base`. In
                `base_link`, multiply by `Robot.T_base_base_link`.

        Raises:
            InvalidProblem: the message has no position and orientation.
        """
        for outer in ("pose", "transform"):
            pose = _part(pose, outer, pose)
        position = _part(pose, "position", _part(pose, "translation"))
        orientation = _part(pose, "orientation", _part(pose, "rotation"))
        if position is None or orientation is None:
            raise InvalidProblem("pose", "A ROS pose must have a position and an orientation.")
        return cls.from_quaternion(
            [_part(position, name) for name in "xyz"],
            [_part(orientation, name) for name in "xyzw"],
        )

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


def nearest_rotation(R: object) -> Array:
    """Rotation matrix (3, 3) nearest to a given one, which was rounded.

    Raises:
        InvalidProblem: it differs from a rotation by more than MATRIX_TOLERANCE.
    """
    given = frozen(R, (3, 3), "pose.rotation")
    left, _, right = np.linalg.svd(given)
    nearest = np.asarray(left @ right)
    if np.abs(nearest - given).max() > MATRIX_TOLERANCE or np.linalg.det(nearest) < 0:
        raise InvalidProblem(
            "pose.rotation",
            "The rotation of the pose's matrix must be orthonormal and right-handed, to within "
            f"{MATRIX_TOLERANCE:g}.",
        )
    return nearest


def metres_per(unit: LengthUnit) -> float:
    """Factor from a unit of length to metres. Raises InvalidProblem if the unit is unknown."""
    check_choice("length", unit, LengthUnit)
    return 1e-3 if unit == "mm" else 1.0


def _part(message: Any, name: str, default: Any = None) -> Any:
    """Field of a message: a key of a dictionary or an attribute of an object."""
    if isinstance(message, Mapping):
        return message.get(name, default)
    return getattr(message, name, default)
