"""How points of a serial chain move, for many configurations at once. Frames as `kinematics.link_frames` gives them."""

from __future__ import annotations

import numpy as np

from models.robot import Array


def point_jacobian(frames: Array, link: int, x: Array) -> Array:
    """∂x/∂q (n, 3, nq) of points x (n, 3) [m] fixed to a link: column j is z_j × (x - p_j), zero beyond the link.

    frames (n, nq + 1, 4, 4); link k is moved by joints 1 … k.
    """
    J = np.zeros((len(x), 3, frames.shape[1] - 1))
    axes, origins = frames[:, 1 : link + 1, :3, 2], frames[:, 1 : link + 1, :3, 3]
    J[:, :, :link] = np.cross(axes, x[:, None] - origins).transpose(0, 2, 1)
    return J


def direction_jacobian(frames: Array, d: Array) -> Array:
    """∂d/∂q (n, 3, nq) of directions d (n, 3) fixed to the last link: column j is z_j × d."""
    return np.asarray(np.cross(frames[:, 1:, :3, 2], d[:, None]).transpose(0, 2, 1))


def velocity_gradient(frames: Array, J: Array, v: Array) -> Array:
    """∂(J v)/∂q (n, 3, nq) for a point's Jacobian J (n, 3, nq) and joint speeds v (n, nq).

    A turn of joint k carries along what the joints after it contribute, and moves the point under the turn of the
    joints up to it: z_k × Σ_{j>k} J_j v_j + (Σ_{j≤k} v_j z_j) × J_k.
    """
    axes = frames[:, 1:, :3, 2]
    parts = J * v[:, None, :]
    after = parts.sum(axis=2, keepdims=True) - np.cumsum(parts, axis=2)
    turning = np.cumsum(axes * v[:, :, None], axis=1)
    gradient = np.cross(axes, after.transpose(0, 2, 1)) + np.cross(turning, J.transpose(0, 2, 1))
    return np.asarray(gradient.transpose(0, 2, 1))
