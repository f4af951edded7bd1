"""Orientations of a robot base: on the floor, on a wall, on the ceiling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.placement.region import Mount


@dataclass(frozen=True)
class MountSettings:
    """Tolerances of mounts."""

    vertical: float = 1e-6
    """Sine of the angle from the vertical below which the base stands on the floor or hangs from
    the ceiling, and from the horizontal below which it is on a wall."""


MOUNT = MountSettings()

TILTS: dict[Mount, Array] = {
    "floor": np.eye(3),
    "wall": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "ceiling": np.diag([1.0, -1.0, -1.0]),
}
"""Rotations (3, 3) of a base at yaw 0, by its mount."""


def about_z(angle: float) -> Array:
    """Rotation matrix (3, 3) about z [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def yaw_of(R: Array) -> float:
    """Angle [rad] about the world's z axis of a base with the rotation R (3, 3).

    It is the angle of the x axis of a base on the floor or the ceiling, and of the z axis of any
    other base.
    """
    along = R[:, 0] if np.hypot(R[0, 2], R[1, 2]) < MOUNT.vertical else R[:, 2]
    return float(np.arctan2(along[1], along[0]))


def mount_of(R: Array) -> Mount | None:
    """The mount of a base with the rotation R (3, 3); None for a base that is tilted."""
    if np.hypot(R[0, 2], R[1, 2]) < MOUNT.vertical:
        return "floor" if R[2, 2] > 0 else "ceiling"
    return "wall" if abs(R[2, 2]) < MOUNT.vertical else None
