"""Poses as ROS writes them are the same as in the form of the schemas."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from joulepath.app.schemas.common import BasePose, Pose
from joulepath.app.schemas.orientation import ConeOrientedPose, TargetPose

PLAIN: dict[str, Any] = {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}
ROS = {
    "position": {"x": 0.4, "y": -0.2, "z": 0.3},
    "orientation": {"x": 0.0, "y": 1.0, "z": 0.0, "w": 0.0},
}
KINDS = [TypeAdapter[Any](kind) for kind in (Pose, BasePose, TargetPose)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("position", [ROS["position"], PLAIN["position"]])
def test_a_pose_of_ros(kind: TypeAdapter[Any], position: Any) -> None:
    assert kind.validate_python(ROS | {"position": position}) == kind.validate_python(PLAIN)


@pytest.mark.parametrize("kind", KINDS[1:])
@pytest.mark.parametrize("frame", ["base", "base_link", "/base_link"])
def test_a_stamped_pose_of_ros(kind: TypeAdapter[Any], frame: str) -> None:
    stamped = {"header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": frame}, "pose": ROS}
    expected = kind.validate_python(PLAIN | {"frame": frame.lstrip("/")})
    assert kind.validate_python(stamped) == expected


@pytest.mark.parametrize("header", [{"frame_id": "map"}, {}, "base", None])
def test_a_pose_stamped_in_another_frame_is_refused(header: Any) -> None:
    with pytest.raises(ValidationError, match="the `frame_id` base or base_link"):
        KINDS[1].validate_python({"header": header, "pose": ROS})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"orientation": {"x": 0.0, "y": 0.5, "z": 0.0, "w": 0.0}}, "norm"),
        ({"orientation": {"x": 0.0, "y": 1.0, "z": 0.0}}, "each of x, y, z and w"),
        ({"orientation": {"x": "0", "y": 1.0, "z": 0.0, "w": 0.0}}, "number"),
        ({"position": {"x": 0.4, "y": -0.2}}, "list"),
        ({"quaternion": [0.0, 1.0, 0.0, 0.0]}, "validation error"),
    ],
)
def test_a_wrong_pose_of_ros_is_refused(changes: dict[str, Any], said: str) -> None:
    for kind in KINDS:
        with pytest.raises(ValidationError, match=said):
            kind.validate_python(ROS | changes)


def test_a_partly_free_orientation_stays_one() -> None:
    found = KINDS[2].validate_python(ROS | {"orientation": "free"})
    assert isinstance(found, ConeOrientedPose)


def test_the_given_object_stays_as_it_is() -> None:
    given = {**ROS}
    KINDS[2].validate_python(given)
    assert given == ROS
