"""Poses from quaternions, angles, rotation vectors, pendants, ROS messages and matrices, against
Pinocchio and SciPy.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.pose import (
    QUATERNION_TOLERANCE,
    Pose,
    rotation_from_quaternion,
    rotation_from_rotvec,
    rotation_from_rpy,
)

# of a rotation computed in double precision in two ways
ROUNDING = 1e-14
# the same for an angle near a half turn, because the rotation vector follows from the matrix by a
# square root
ANGLE_ROUNDING = 1e-7
POSITION = [0.1, -0.2, 0.3]
ANGLES = [
    [0.0, 0.0, 0.0],
    [0.3, -0.8, 2.1],
    [np.pi, 0.0, 0.0],
    [0.0, -np.pi, 0.0],
    [1e-12, 0.0, 1e-9],
    [5e-324, 0.0, 0.0],
    [-3.0, np.pi / 2, 7.0],
    [900.0, -700.0, 1000.0],
]


def difference(A: Array, B: Array) -> float:
    """The largest between two matrices' elements."""
    return float(np.abs(A - B).max())


@pytest.mark.parametrize("rpy", ANGLES)
def test_rpy_are_rotations_about_fixed_axes(rpy: list[float]) -> None:
    R = rotation_from_rpy(rpy)
    assert difference(R, pin.rpy.rpyToMatrix(*rpy)) < ROUNDING
    # in scipy, lower-case letters are fixed axes
    assert difference(R, Rotation.from_euler("xyz", rpy).as_matrix()) < ROUNDING


@pytest.mark.parametrize("rotvec", ANGLES)
def test_a_rotation_vector_is_axis_times_angle(rotvec: list[float]) -> None:
    R = rotation_from_rotvec(rotvec)
    # the angle [rad] of a long vector is itself rounded
    rounding = ROUNDING * max(1.0, float(np.linalg.norm(rotvec)) / np.pi)
    assert difference(R, pin.exp3(np.array(rotvec))) < rounding
    assert difference(R, Rotation.from_rotvec(rotvec).as_matrix()) < rounding


def test_a_quaternion_is_x_y_z_w_and_normalised() -> None:
    for quaternion in np.random.default_rng(1).normal(size=(200, 4)):
        unit = quaternion / np.linalg.norm(quaternion)
        R = rotation_from_quaternion(unit)
        assert difference(R, pin.Quaternion(unit).toRotationMatrix()) < ROUNDING
        assert difference(R, Rotation.from_quat(unit).as_matrix()) < ROUNDING
        assert (
            difference(rotation_from_quaternion((1 - 0.9 * QUATERNION_TOLERANCE) * unit), R)
            < ROUNDING
        )


def test_zero_angles_are_exactly_the_identity() -> None:
    for R in (
        rotation_from_rpy([0, 0, 0]),
        rotation_from_rotvec([0, 0, 0]),
        rotation_from_quaternion([0, 0, 0, 1]),
    ):
        assert difference(R, np.eye(3)) == 0


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_half_turns(axis: list[float]) -> None:
    """About an axis e, all three forms give 2 e eᵀ - I."""
    e = np.array(axis)
    expected = 2 * np.outer(e, e) - np.eye(3)
    for R in (
        rotation_from_rotvec(np.pi * e),
        rotation_from_rotvec(-np.pi * e),
        rotation_from_rpy(np.pi * e),
        rotation_from_quaternion([*axis, 0.0]),
    ):
        assert difference(R, expected) < ROUNDING


def test_small_angles_keep_all_their_digits() -> None:
    """R - I is the cross-product matrix of the vector, up to the square of the angle."""
    for angle in (1e-160, 1e-20, 1e-12, 1e-9):
        vector = angle * np.array([0.6, -0.64, 0.48])
        for R in (rotation_from_rotvec(vector), rotation_from_rpy(vector)):
            off_diagonal = np.array([R[2, 1], R[0, 2], R[1, 0]])
            assert np.abs(off_diagonal - vector).max() < (2 * angle + ROUNDING) * angle


def test_there_and_back() -> None:
    for angles in np.random.default_rng(3).uniform(-2 * np.pi, 2 * np.pi, (200, 3)):
        quaternion = Rotation.from_rotvec(angles).as_quat()
        from_rotvec, from_quaternion = (
            Pose.from_rotvec(POSITION, angles),
            Pose.from_quaternion(POSITION, quaternion),
        )
        assert difference(from_rotvec.T, from_quaternion.T) < ROUNDING
        back = Pose.from_rotvec(POSITION, pin.log3(from_rotvec.T[:3, :3]))
        assert difference(back.T, from_rotvec.T) < ANGLE_ROUNDING
        from_rpy = Pose.from_rpy(POSITION, angles)
        back = Pose.from_rpy(POSITION, pin.rpy.matrixToRpy(from_rpy.T[:3, :3]))
        assert difference(back.T, from_rpy.T) < ANGLE_ROUNDING


@pytest.mark.parametrize(
    "pose",
    [
        Pose.from_rpy(POSITION, [0.3, -0.8, 2.1]),
        Pose.from_rotvec(POSITION, [0.3, -0.8, 2.1]),
        Pose.from_quaternion(POSITION, [0.5, -0.5, 0.5, 0.5]),
    ],
    ids=["rpy", "rotvec", "quaternion"],
)
def test_a_pose_is_homogeneous_and_read_only(pose: Pose) -> None:
    assert pose.T[:3, 3].tolist() == POSITION
    assert pose.T[3].tolist() == [0, 0, 0, 1]
    with pytest.raises(ValueError, match="read-only"):
        pose.T[0, 0] = 1.0


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Pose.from_rpy([0, 0], [0, 0, 0]), "pose.position"),
        (lambda: Pose.from_rpy(POSITION, [0, 0, 0, 0]), "pose.rpy"),
        (lambda: Pose.from_rpy(POSITION, [0, np.nan, 0]), "pose.rpy"),
        (lambda: Pose.from_rotvec(POSITION, [0, 0, np.inf]), "pose.rotvec"),
        (lambda: Pose.from_rotvec(POSITION, "up"), "pose.rotvec"),
        (lambda: Pose.from_quaternion(POSITION, [0, 0, 1]), "pose.quaternion"),
        (lambda: Pose.from_quaternion(POSITION, [0, 0, 0, 0]), "pose.quaternion"),
        (
            lambda: Pose.from_quaternion(POSITION, [0, 0, 0, 1 + 1.1 * QUATERNION_TOLERANCE]),
            "pose.quaternion",
        ),
        (lambda: Pose.from_rotation(POSITION, np.diag([1.0, 1.0, -1.0])), "pose"),
        (lambda: Pose.from_rotation(POSITION, np.eye(4)), "pose.rotation"),
    ],
)
def test_refusals_name_the_field(make: Callable[[], Any], field: str) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        make()
    assert refusal.value.field == field
    assert str(refusal.value).endswith(".")


ROTVEC = [2.221, -2.221, 0.0]
DOWNWARD = [0.0, 1.0, 0.0, 0.0]


def test_the_pendant_of_universal_robots_shows_millimetres_and_a_rotation_vector() -> None:
    pose = Pose.from_pendant([400.0, -200.0, 300.0, *ROTVEC])
    assert pose.T[:3, 3] == pytest.approx([0.4, -0.2, 0.3])
    assert pose.T[:3, :3] == pytest.approx(rotation_from_rotvec(ROTVEC))
    in_metres = Pose.from_pendant([0.4, -0.2, 0.3, *ROTVEC], length="m")
    assert pytest.approx(pose.T) == in_metres.T


def test_other_pendants_show_angles() -> None:
    rpy = np.radians([170.0, 20.0, -35.0])
    position = [400.0, -200.0, 300.0]
    fanuc = Pose.from_pendant([*position, 170.0, 20.0, -35.0], rotation="rpy", angle="deg")
    kuka = Pose.from_pendant([*position, -35.0, 20.0, 170.0], rotation="abc", angle="deg")
    for pose in (fanuc, kuka):
        assert pose.T[:3, :3] == pytest.approx(rotation_from_rpy(rpy))


@pytest.mark.parametrize("options", [{"length": "cm"}, {"angle": "grad"}, {"rotation": "euler"}])
def test_an_unknown_unit_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InvalidProblem, match=f"{next(iter(options))} must be one of"):
        Pose.from_pendant([400.0, -200.0, 300.0, *ROTVEC], **options)


def fields(names: str, values: list[float]) -> dict[str, float]:
    return dict(zip(names, values, strict=True))


def objects(value: Any) -> Any:
    """A message as rclpy has it: attributes instead of keys."""
    if not isinstance(value, dict):
        return value
    return SimpleNamespace(**{name: objects(each) for name, each in value.items()})


@pytest.mark.parametrize(
    "message",
    [
        {"position": fields("xyz", [0.4, -0.2, 0.3]), "orientation": fields("xyzw", DOWNWARD)},
        {"translation": fields("xyz", [0.4, -0.2, 0.3]), "rotation": fields("xyzw", DOWNWARD)},
    ],
)
def test_messages_of_ros(message: dict[str, Any]) -> None:
    expected = Pose.from_quaternion([0.4, -0.2, 0.3], DOWNWARD).T
    outer = "pose" if "position" in message else "transform"
    stamped = {"header": {"frame_id": "base"}, outer: message}
    for given in (message, stamped, objects(message), objects(stamped)):
        assert pytest.approx(expected) == Pose.from_ros(given).T


@pytest.mark.parametrize("message", [{}, {"position": fields("xyz", [1.0, 2.0, 3.0])}, 3])
def test_a_message_without_a_pose_is_refused(message: Any) -> None:
    with pytest.raises(InvalidProblem, match="must have a position and an orientation"):
        Pose.from_ros(message)


def test_a_rounded_matrix_is_taken() -> None:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_from_rotvec([0.3, -1.1, 0.4]), [400.0, -200.0, 300.0]
    pose = Pose.from_matrix(T.round(4), unit="mm")
    assert pose.T[:3, :3] == pytest.approx(T[:3, :3], abs=2e-4)
    assert pose.T[:3, 3] == pytest.approx([0.4, -0.2, 0.3])
    exact = Pose.from_matrix(T, unit="mm")
    assert exact.T[:3, :3] == pytest.approx(T[:3, :3], abs=1e-12)


@pytest.mark.parametrize("rotation", [2 * np.eye(3), np.diag([1.0, 1.0, -1.0])])
def test_a_matrix_that_is_no_rotation_is_refused(rotation: Any) -> None:
    T = np.eye(4)
    T[:3, :3] = rotation
    with pytest.raises(InvalidProblem, match="orthonormal and right-handed"):
        Pose.from_matrix(T)
