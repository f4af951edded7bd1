"""Converts fields of ROS messages to fields of `POST /optimize`, without a ROS installation."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from joulepath.app.exceptions.base import FieldError, InvalidRequest

Json = dict[str, Any]
BASE_FRAMES = ("base", "base_link")
"""Frames of poses in requests."""
MOST_NAMES = 20
"""Largest number of joint names of a message in an error."""


@dataclass(frozen=True)
class JointNames:
    """Names of the robot's joints in the ROS system.

    Attributes:
        joints: names in the robot's model, from base to tip.
        prefix: common prefix of the names in ROS, such as `left_`.
    """

    joints: tuple[str, ...]
    prefix: str = ""

    @property
    def in_ros(self) -> list[str]:
        """The names with the prefix, from base to tip."""
        return [self.prefix + joint for joint in self.joints]

    def positions(self, topic: str, names: Sequence[str], values: Sequence[float]) -> list[float]:
        """The positions [rad] in a JointState, from base to tip; its other joints are left out.

        Args:
            topic: topic of the message, for errors.
            names: its `name`, in any order.
            values: its `position` [rad].

        Raises:
            InvalidRequest: a joint of the robot is missing or occurs twice, the two fields differ
                in length, or a position is not finite.
        """
        if len(names) != len(values):
            raise refusal(
                (topic, "position"),
                f"The message has {len(names)} names and {len(values)} positions: give each joint "
                "in `name` one value in `position`.",
            )
        count = Counter(names)
        for name in self.in_ros:
            if not count[name]:
                raise refusal((topic, "name"), self._missing(name, names))
            if count[name] > 1:
                raise refusal((topic, "name"), f"The joint {name} occurs twice: name it once.")
        at = dict(zip(names, map(float, values), strict=True))
        found = [at[name] for name in self.in_ros]
        for name, value in zip(self.in_ros, found, strict=True):
            if not math.isfinite(value):
                raise refusal(
                    (topic, "position"),
                    f"The position of {name} is {value}: give a finite number in rad.",
                )
        return found

    def _missing(self, joint: str, names: Sequence[str]) -> str:
        bare = joint.removeprefix(self.prefix)
        prefixes = sorted({name.removesuffix(bare) for name in names if name.endswith(bare)})
        remedy = (
            f"set the parameter `prefix` to {' or '.join(repr(each) for each in prefixes)}"
            if prefixes
            else "name all joints of the robot, or choose another `robot`"
        )
        known = ", ".join(names[:MOST_NAMES]) or "none"
        more = ", …" if len(names) > MOST_NAMES else ""
        return f"The joint {joint} is missing; the message has {known}{more}: {remedy}."


def pose_target(
    topic: str,
    frame_id: str,
    position: Sequence[float],
    quaternion: Sequence[float],
    prefix: str,
    base_frame: str,
) -> Json:
    """The target of a PoseStamped message with the pose of the TCP.

    Args:
        topic: topic of the message, for errors.
        frame_id: frame of its header; empty for the base frame.
        position: x, y, z [m].
        quaternion: x, y, z, w.
        prefix: prefix of the robot's frames.
        base_frame: frame of the robot's base in ROS: `base_link` of its description.

    Raises:
        InvalidRequest: the frame is not a frame of the base.
    """
    frames = {prefix + frame: frame for frame in BASE_FRAMES}
    frames |= {base_frame: "base_link", "": "base_link"}
    if frame_id not in frames:
        known = ", ".join(sorted(frame for frame in frames if frame))
        raise refusal(
            (topic, "header", "frame_id"),
            f"The frame {frame_id!r} is not a frame of the robot's base: transform the pose into "
            f"one of {known}, or set the parameter `base_frame`.",
        )
    return {
        "pose": {
            "position": list(position),
            "quaternion": list(quaternion),
            "frame": frames[frame_id],
        }
    }


def summary_of(answer: Json) -> Json:
    """Summary of a plan for its caller, from the answer of `POST /optimize`."""
    objective, energy = answer["objective"], answer["energy"]
    return {
        "state": "planned",
        "robot": answer["robot"],
        "status": answer["status"],
        "objective": objective,
        "energy": energy[objective]["total"],
        "duration": answer["duration"],
        "lower_bound": energy["lower_bound"],
        "optimality_gap": energy["optimality_gap"],
        "certificate": answer["certificate"],
        "branch": answer["branch"]["goal"]["label"],
        "baselines": [
            {name: each[name] for name in ("name", objective, "duration", "saving")}
            for each in answer["baselines"]
        ],
        "alternatives": [
            {name: each[name] for name in ("goal", "q_goal", "energy", "duration", "status")}
            for each in answer["candidates"]
        ],
        "warnings": answer["warnings"],
    }


def refusal(field: Sequence[str], message: str) -> InvalidRequest:
    """The error for a field of a message; the path `field` begins with the topic."""
    return InvalidRequest([FieldError(loc=list(field), msg=message)], message)
