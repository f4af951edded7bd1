"""Poses whose orientation is free in part: which orientations they allow, how far one is from them, and samples."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from scipy.stats import qmc

from models.robot import Array
from optimizer.arm import Pose, frozen
from optimizer.exceptions import InvalidProblem

# an axis shorter than this has no direction
SHORTEST_AXIS = 1e-9
# of the tool's axis against the direction: below it their common normal is any [1]
PARALLEL = 1e-12


@dataclass(frozen=True)
class LoosePose:
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
    def about(pose: Pose, axis: Array) -> LoosePose:
        """That pose, or any that a rotation about `axis` (3,), given in the TCP frame, makes of it."""
        return LoosePose(pose.T[:3, 3], axis, pose.T[:3, :3] @ frozen(axis, (3,), "pose.orientation.axis"), 0.0)

    @property
    def freedom(self) -> int:
        """How many independent ways there are to turn."""
        return 3 if self.half_angle > 0 else 1

    def tilt(self, R: Array) -> Array:
        """Rotation vector (3,) [rad], in the base frame, that takes `direction` to where R (3, 3) puts `axis`."""
        pointing = R @ self.axis
        normal = np.cross(self.direction, pointing)
        sine = float(np.linalg.norm(normal))
        angle = float(np.arctan2(sine, self.direction @ pointing))
        if sine < PARALLEL:
            normal, sine = _across(self.direction), 1.0
        return np.asarray(normal * (angle / sine))

    def excess(self, R: Array) -> float:
        """Angle [rad] by which R (3, 3) lies beyond the orientations allowed: 0 for these."""
        return max(0.0, float(np.linalg.norm(self.tilt(R))) - self.half_angle)

    def nearest(self, R: Array) -> Array:
        """The orientation allowed (3, 3) that is the least rotation away from R (3, 3)."""
        excess = self.excess(R)
        if excess == 0.0:
            return R
        tilt = self.tilt(R)
        return np.asarray(pin.exp3(-tilt * (excess / np.linalg.norm(tilt))) @ R)

    def sample(self, count: int) -> Array:
        """So many orientations allowed (count, 3, 3), spread evenly, always the same.

        The axis falls evenly on the cone's cap of the sphere, the rotation about it evenly on the circle.
        """
        points = qmc.Halton(3, scramble=False).random(count) if self.half_angle > 0 else np.zeros((count, 3))
        if self.half_angle == 0:
            points[:, 2] = np.arange(count) / count
        level, azimuth, spin = points.T
        tilt = np.arccos(1 - level * (1 - np.cos(self.half_angle)))
        u = _across(self.direction)
        across = np.cos(2 * np.pi * azimuth)[:, None] * u
        across += np.sin(2 * np.pi * azimuth)[:, None] * np.cross(self.direction, u)
        R0 = _turning(self.axis, self.direction)
        return np.array(
            [
                pin.exp3(t * a) @ R0 @ pin.exp3(2 * np.pi * s * self.axis)
                for t, a, s in zip(tilt, across, spin, strict=True)
            ]
        )

    def pose(self, R: Array) -> Pose:
        """The pose at this position with the orientation R (3, 3)."""
        return Pose(pin.SE3(R, self.position).homogeneous)


def _across(axis: Array) -> Array:
    """A unit vector at right angles to a unit vector."""
    other = np.eye(3)[int(np.abs(axis).argmin())]
    across = np.cross(axis, other)
    return np.asarray(across / np.linalg.norm(across))


def _turning(a: Array, b: Array) -> Array:
    """The least rotation (3, 3) that takes the unit vector a to b."""
    normal = np.cross(a, b)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL:
        return np.eye(3) if a @ b > 0 else np.asarray(pin.exp3(np.pi * _across(a)))
    return np.asarray(pin.exp3(normal / sine * np.arctan2(sine, a @ b)))
