"""Poses with an orientation tolerance: an axis of the tool within a cone about a direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arrays import frozen, unit_vector
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.scalars import check_number


@dataclass(frozen=True)
class ConeOrientedPose:
    """Position of the TCP, with an axis of the tool within a cone.

    The rotation about the axis is free. A `half_angle` of pi allows every orientation, a
    `half_angle` of 0 only the rotation about the axis. Both vectors are normalised.

    Attributes:
        position: position of the TCP in the base frame, shape (3,) [m].
        axis: axis of the tool in the TCP frame, shape (3,).
        direction: axis of the cone in the base frame, shape (3,).
        half_angle: half angle of the cone, from 0 to pi [rad].

    Raises:
        InvalidProblem: a vector is zero, or the angle out of range.
    """

    position: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    direction: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    half_angle: float = np.pi

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position, (3,), "pose.position"))
        for name in ("axis", "direction"):
            object.__setattr__(
                self, name, unit_vector(getattr(self, name), f"pose.orientation.{name}")
            )
        check_number("pose.orientation.half_angle", self.half_angle, "radians", most=np.pi)

    @staticmethod
    def about(pose: Pose, axis: Array) -> ConeOrientedPose:
        """A pose with a free rotation about an axis.

        Args:
            pose: pose with the direction of the axis.
            axis: axis in the TCP frame, shape (3,).

        Raises:
            InvalidProblem: the axis is zero.
        """
        axis = frozen(axis, (3,), "pose.orientation.axis")
        return ConeOrientedPose(pose.T[:3, 3], axis, pose.T[:3, :3] @ axis, 0.0)

    @property
    def freedom(self) -> int:
        """Number of free rotations: 3, or 1 about the axis alone."""
        return 3 if self.half_angle > 0 else 1

    def with_orientation(self, R: Array) -> Pose:
        """The pose at this position with the orientation R (3, 3)."""
        return Pose.from_rotation(self.position, R)
