"""The limits that a motion was held to, in answers."""

from __future__ import annotations

from joulepath.app.schemas.common import Response, described

Joints = list[float]


class LimitsInForce(Response):
    """The limits that the motion was held to: those of the robot, or the tighter ones of the request. Lists are per
    joint, from base to flange; null: no limit."""

    position_min: Joints = described("Least joint position.", "rad", [-6.28, -6.28, -3.14, -6.28, -6.28, -6.28])
    position_max: Joints = described("Greatest joint position.", "rad", [6.28, 6.28, 3.14, 6.28, 6.28, 6.28])
    velocity: Joints = described("Joint velocity.", "rad/s", [3.14] * 6)
    acceleration: Joints = described("Joint acceleration.", "rad/s²", [10.0] * 6)
    jerk: list[float | None] = described("Joint jerk.", "rad/s³", [200.0] * 6)
    torque: Joints = described(
        "Torque at the joint, on the side of the robot's `limits.torque_side`.",
        "N·m",
        [150.0, 150.0, 150.0, 28.0, 28.0, 28.0],
    )
    tcp_speed: float | None = described("Speed of the TCP.", "m/s", 1.0)
    elbow_speed: float | None = described("Speed of the elbow.", "m/s", 1.0)
