"""Poses with an orientation tolerance: an axis of the tool within a cone about a direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arrays import frozen, unit_vector
from joulepath.optimizer.problem.pose import Pose


@dataclass(frozen=True)
class ConeOrientedPose:
    """The TCP at `position` (3,) [m] in the base frame, with `axis` at most `half_angle` [rad] away
    from `direction`.

    `axis` (3,) is fixed to the tool, in the TCP frame; `direction` (3,) is in the base frame. Both
    are normalised. The rotation about the axis is free. A `half_angle` of pi therefore allows every
    orientation; one of 0 leaves only the rotation about the axis.

    Raises InvalidProblem if `axis` or `direction` is zero, or if `half_angle` is not in [0, pi].
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
        if not 0 <= self.half_angle <= np.pi:
            raise InvalidProblem(
                "pose.orientation.half_angle",
                "pose.orientation.half_angle must be between 0 and pi rad.",
            )

    @staticmethod
    def about(pose: Pose, axis: Array) -> ConeOrientedPose:
        """`pose` with a free rotation about `axis` (3,), which is given in the TCP frame. Raises
        InvalidProblem.
        """
        axis = frozen(axis, (3,), "pose.orientation.axis")
        return ConeOrientedPose(pose.T[:3, 3], axis, pose.T[:3, :3] @ axis, 0.0)

    @property
    def freedom(self) -> int:
        """Number of independent rotations that the tolerance leaves: 3, or 1 about the axis
        alone."""
        return 3 if self.half_angle > 0 else 1

    def with_orientation(self, R: Array) -> Pose:
        """The pose at this position with the orientation R (3, 3)."""
        return Pose.from_rotation(self.position, R)
