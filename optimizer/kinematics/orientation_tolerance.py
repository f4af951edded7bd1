"""Orientations that a pose with an orientation tolerance allows: distance from them, projection onto them, samples."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.stats import qmc

from models.robot import Array
from optimizer.problem.cone_oriented_pose import ConeOrientedPose

# of the tool's axis against the direction: below it their common normal is any [1]
PARALLEL = 1e-12


def tilt(pose: ConeOrientedPose, R: Array) -> Array:
    """Rotation vector (3,) [rad], in the base frame, that takes `direction` to where R (3, 3) puts `axis`."""
    pointing = R @ pose.axis
    normal = np.cross(pose.direction, pointing)
    sine = float(np.linalg.norm(normal))
    angle = float(np.arctan2(sine, pose.direction @ pointing))
    if sine < PARALLEL:
        normal, sine = _across(pose.direction), 1.0
    return np.asarray(normal * (angle / sine))


def excess_angle(pose: ConeOrientedPose, R: Array) -> float:
    """Angle [rad] by which R (3, 3) lies beyond the orientations allowed: 0 for these."""
    return max(0.0, float(np.linalg.norm(tilt(pose, R))) - pose.half_angle)


def nearest_orientation(pose: ConeOrientedPose, R: Array) -> Array:
    """The orientation allowed (3, 3) that is the least rotation away from R (3, 3)."""
    excess = excess_angle(pose, R)
    if excess == 0.0:
        return R
    beyond = tilt(pose, R)
    return np.asarray(pin.exp3(-beyond * (excess / np.linalg.norm(beyond))) @ R)


def sample_orientations(pose: ConeOrientedPose, count: int) -> Array:
    """So many orientations allowed (count, 3, 3), spread evenly, always the same.

    The axis falls evenly on the cone's cap of the sphere, the rotation about it evenly on the circle.
    """
    points = qmc.Halton(3, scramble=False).random(count) if pose.half_angle > 0 else np.zeros((count, 3))
    if pose.half_angle == 0:
        points[:, 2] = np.arange(count) / count
    level, azimuth, spin = points.T
    angles = np.arccos(1 - level * (1 - np.cos(pose.half_angle)))
    u = _across(pose.direction)
    across = np.cos(2 * np.pi * azimuth)[:, None] * u
    across += np.sin(2 * np.pi * azimuth)[:, None] * np.cross(pose.direction, u)
    R0 = _turning(pose.axis, pose.direction)
    return np.array(
        [
            pin.exp3(t * a) @ R0 @ pin.exp3(2 * np.pi * s * pose.axis)
            for t, a, s in zip(angles, across, spin, strict=True)
        ]
    )


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
