"""Poses with an orientation tolerance: an axis of the tool within a cone about a direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.problem.arrays import frozen
from optimizer.problem.pose import Pose

# an axis shorter than this has no direction
SHORTEST_AXIS = 1e-9


@dataclass(frozen=True)
class ConeOrientedPose:
    """The TCP at `position` (3,) [m] in the base frame, turned so that `axis` is within `half_angle` of `direction`.

    `axis` (3,) is fixed to the tool, in the TCP frame; `direction` (3,) is in the base frame; both are normalised. A
    `half_angle` [rad] of pi allows every orientation, one of 0 any rotation about the axis alone.

    Raises InvalidProblem when an axis has no length, or the angle is not in [0, pi].
    """

    position: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    direction: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    half_angle: float = np.pi

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position, (3,), "pose.position"))
        for name in ("axis", "direction"):
            vector = frozen(getattr(self, name), (3,), f"pose.orientation.{name}")
            length = float(np.linalg.norm(vector))
            if length < SHORTEST_AXIS:
                raise InvalidProblem(f"pose.orientation.{name}", f"The orientation's {name} must not be zero.")
            object.__setattr__(self, name, frozen(vector / length, (3,), f"pose.orientation.{name}"))
        if not 0 <= self.half_angle <= np.pi:
            raise InvalidProblem(
                "pose.orientation.half_angle", "The orientation's half_angle must lie between 0 and pi."
            )

    @staticmethod
    def about(pose: Pose, axis: Array) -> ConeOrientedPose:
        """That pose, or any that a rotation about `axis` (3,), given in the TCP frame, makes of it."""
        return ConeOrientedPose(pose.T[:3, 3], axis, pose.T[:3, :3] @ frozen(axis, (3,), "pose.orientation.axis"), 0.0)

    @property
    def freedom(self) -> int:
        """How many independent ways there are to turn."""
        return 3 if self.half_angle > 0 else 1

    def with_orientation(self, R: Array) -> Pose:
        """The pose at this position with the orientation R (3, 3)."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, self.position
        return Pose(T)
