"""Orientations within an orientation tolerance: distance, projection, samples."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose

PARALLEL_SINE = 1e-12
"""Sine of the angle between two axes below which any common normal serves as rotation axis."""


def tilt(pose: ConeOrientedPose, R: Array) -> Array:
    """Rotation vector (3,) [rad], in the base frame, from `direction` to the tool axis at R
    (3, 3).
    """
    pointing = R @ pose.axis
    normal = np.cross(pose.direction, pointing)
    sine = float(np.linalg.norm(normal))
    angle = float(np.arctan2(sine, pose.direction @ pointing))
    if sine < PARALLEL_SINE:
        normal, sine = _across(pose.direction), 1.0
    return np.asarray(normal * (angle / sine))


def excess_angle(pose: ConeOrientedPose, R: Array) -> float:
    """Angle [rad] by which the tool axis at R (3, 3) lies outside the cone; 0 if it is inside."""
    return max(0.0, float(np.linalg.norm(tilt(pose, R))) - pose.half_angle)


def nearest_orientation(pose: ConeOrientedPose, R: Array) -> Array:
    """Allowed orientation (3, 3) at the smallest angle from R (3, 3)."""
    excess = excess_angle(pose, R)
    if excess == 0.0:
        return R
    beyond = tilt(pose, R)
    return np.asarray(pin.exp3(-beyond * (excess / np.linalg.norm(beyond))) @ R)


def within_cone(arm: Arm, pose: ConeOrientedPose, share: float = 1.0) -> ConeOrientedPose:
    """The pose without the orientations that the cone of the arm's tool excludes.

    It is the pose itself unless both cones have the same axes or the pose allows any orientation.
    With the excluded orientations, few samples would lie in a narrow cone, and a lower bound would
    count motions that are not allowed.

    Args:
        arm: arm with the tool.
        pose: pose of partly free orientation.
        share: largest share of the tool cone's half angle that the pose may use.
    """
    cone = arm.tool_cone
    if cone is None:
        return pose
    is_free = pose.half_angle == np.pi
    same_axes = np.allclose(pose.axis, cone.axis) and np.allclose(pose.direction, cone.direction)
    if not is_free and not same_axes:
        return pose
    half_angle = min(pose.half_angle, share * cone.half_angle)
    return ConeOrientedPose(pose.position, cone.axis, cone.direction, half_angle)


def sample_orientations(pose: ConeOrientedPose, count: int) -> Array:
    """Evenly spread, deterministic sample (count, 3, 3) of the allowed orientations.

    The points are a Halton sequence: the tool axis is uniform on the cone's spherical cap, the
    rotation about it uniform on the circle.
    """
    if pose.half_angle > 0:
        level, azimuth, spin = (_radical_inverse(base, count) for base in (2, 3, 5))
    else:
        level, azimuth, spin = np.zeros(count), np.zeros(count), np.arange(count) / count
    angles = np.arccos(1 - level * (1 - np.cos(pose.half_angle)))
    u = _across(pose.direction)
    across = np.cos(2 * np.pi * azimuth)[:, None] * u
    across += np.sin(2 * np.pi * azimuth)[:, None] * np.cross(pose.direction, u)
    R0 = _least_rotation(pose.axis, pose.direction)
    return np.array(
        [
            pin.exp3(t * a) @ R0 @ pin.exp3(2 * np.pi * s * pose.axis)
            for t, a, s in zip(angles, across, spin, strict=True)
        ]
    )


def _across(axis: Array) -> Array:
    """Unit vector perpendicular to a unit vector."""
    other = np.eye(3)[int(np.abs(axis).argmin())]
    across = np.cross(axis, other)
    return np.asarray(across / np.linalg.norm(across))


def _least_rotation(a: Array, b: Array) -> Array:
    """Rotation (3, 3) of least angle from the unit vector a to the unit vector b."""
    normal = np.cross(a, b)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL_SINE:
        return np.eye(3) if a @ b > 0 else np.asarray(pin.exp3(np.pi * _across(a)))
    return np.asarray(pin.exp3(normal / sine * np.arctan2(sine, a @ b)))


def _radical_inverse(base: int, count: int) -> Array:
    """Radical inverses (count,) of 0 … count - 1, one axis of a Halton sequence.

    Written out, because importing scipy.stats takes longer than all other imports of a request.
    """
    number, found, weight = np.arange(count), np.zeros(count), 1.0
    while number.any():
        weight /= base
        found += weight * (number % base)
        number //= base
    return found
