"""Poses from pendants, from ROS and from matrices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.pose import Pose, rotation_from_rotvec, rotation_from_rpy

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
    with pytest.raises(InvalidProblem, match="has a position and an orientation"):
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
