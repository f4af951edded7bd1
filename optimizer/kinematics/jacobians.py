"""Jacobians of points and directions of a serial chain, for n configurations at once.

The frames (n, nq + 1, 4, 4) are those of `forward.link_frames`.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.vectors import cross


def point_jacobian(frames: Array, link: int, x: Array) -> Array:
    """Jacobian ∂x/∂q (n, 3, nq) of points x (n, 3) [m], in the base frame, fixed to a link.

    Column j is z_j × (x - p_j) for the joints 1 … `link`, which move the link, and zero for the
    joints beyond.
    """
    J = np.zeros((len(x), 3, frames.shape[1] - 1))
    axes, origins = frames[:, 1 : link + 1, :3, 2], frames[:, 1 : link + 1, :3, 3]
    J[:, :, :link] = cross(axes, x[:, None] - origins).transpose(0, 2, 1)
    return J


def direction_jacobian(frames: Array, d: Array) -> Array:
    """Jacobian ∂d/∂q (n, 3, nq) of directions d (n, 3), in the base frame, fixed to the last link.

    Column j is z_j × d.
    """
    return np.asarray(np.cross(frames[:, 1:, :3, 2], d[:, None]).transpose(0, 2, 1))


def geometric_jacobian(frames: Array, x: Array) -> Array:
    """Geometric Jacobian (n, 6, nq) of a frame fixed to the last link with its origin at x (n, 3)
    [m].

    Rows are in base axes: linear velocity [m/rad] first, then angular velocity with column j equal
    to z_j.
    """
    linear = point_jacobian(frames, frames.shape[1] - 1, x)
    return np.concatenate([linear, frames[:, 1:, :3, 2].transpose(0, 2, 1)], axis=1)


def velocity_gradient(frames: Array, J: Array, v: Array) -> Array:
    """Gradient ∂(J v)/∂q (n, 3, nq) of a point's velocity, for its Jacobian J (n, 3, nq) and v (n,
    nq) [rad/s].

    Joint k rotates the contributions of the joints after it, and the rotation of the joints up to k
    turns its own column. Column k is therefore z_k × Σ_{j>k} J_j v_j + (Σ_{j≤k} v_j z_j) × J_k.
    """
    axes = frames[:, 1:, :3, 2]
    parts = J * v[:, None, :]
    after = parts.sum(axis=2, keepdims=True) - np.cumsum(parts, axis=2)
    turning = np.cumsum(axes * v[:, :, None], axis=1)
    gradient = np.cross(axes, after.transpose(0, 2, 1)) + np.cross(turning, J.transpose(0, 2, 1))
    return np.asarray(gradient.transpose(0, 2, 1))
