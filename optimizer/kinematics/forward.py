"""Forward kinematics of many configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from models.robot import Array


def joint_placements(model: pin.Model) -> Array:
    """Where every joint of a chain is mounted on the link before it (nq, 4, 4)."""
    return np.array([placement.homogeneous for placement in model.jointPlacements][1:])


def link_frames(placements: Array, q: Array) -> Array:
    """T_base_link (n, nq + 1, 4, 4) of revolute joints about z, mounted at `placements`, for q (n, nq) [rad].

    The first is the base's own frame, the identity; link k's lies on joint k, with z along its axis.
    """
    frames = np.zeros((len(q), q.shape[1] + 1, 4, 4))
    frames[:, 0] = np.eye(4)
    turns = np.zeros((*q.shape, 4, 4))
    turns[..., 0, 0] = turns[..., 1, 1] = np.cos(q)
    turns[..., 1, 0] = np.sin(q)
    turns[..., 0, 1] = -turns[..., 1, 0]
    turns[..., 2, 2] = turns[..., 3, 3] = 1
    turns = placements @ turns
    for j in range(q.shape[1]):
        np.matmul(frames[:, j], turns[:, j], out=frames[:, j + 1])
    return frames
