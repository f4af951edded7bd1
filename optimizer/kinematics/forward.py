"""Forward kinematics of n configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.native.shared_library import address, shared_library


def joint_placements(model: pin.Model) -> Array:
    """Poses (nq, 4, 4) of the joints of a chain, each in the frame of the link before it."""
    return np.array([placement.homogeneous for placement in model.jointPlacements][1:])


def link_frames(placements: Array, q: Array) -> Array:
    """T_base_link (n, nq + 1, 4, 4) for q (n, nq) [rad] of revolute joints about z at `placements` (nq, 4, 4).

    Frame 0 is that of the base, the identity. Frame k, of link k, lies on joint k with z along the joint's axis.
    """
    library, nq = shared_library(), q.shape[1]
    if library is None:
        return link_frames_by_numpy(placements, q)
    q, placements = np.ascontiguousarray(q, dtype=float), np.ascontiguousarray(placements)
    frames = np.empty((len(q), nq + 1, 4, 4))
    library.link_frames(len(q), nq, address(placements), address(q), address(frames))
    return frames


def link_frames_by_numpy(placements: Array, q: Array) -> Array:
    """The same where the shared library cannot be compiled."""
    c, s = np.cos(q)[..., None], np.sin(q)[..., None]
    x, y = placements[..., 0], placements[..., 1]
    frames = np.empty((len(q), q.shape[1] + 1, 4, 4))
    frames[:, 0] = np.eye(4)
    # each joint's placement, turned about its z axis
    steps = np.empty((*q.shape, 4, 4))
    steps[..., 0], steps[..., 1] = c * x + s * y, c * y - s * x
    steps[..., 2:] = placements[..., 2:]
    for j in range(q.shape[1]):
        np.matmul(frames[:, j], steps[:, j], out=frames[:, j + 1])
    return frames
