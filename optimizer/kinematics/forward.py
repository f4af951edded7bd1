"""Forward kinematics of n configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.native.shared_library import address, library


def joint_placements(model: pin.Model) -> Array:
    """Poses (nq, 4, 4) of the joints of a chain, each in the frame of the previous link."""
    return np.array([placement.homogeneous for placement in model.jointPlacements][1:])


def link_frames(placements: Array, q: Array) -> Array:
    """Frames of all links, T_base_link, shape (n, nq + 1, 4, 4).

    Frame 0 is the base frame, the identity. Frame k belongs to link k: its origin lies on joint k
    and its z axis along the axis of this joint.

    Args:
        placements: poses (nq, 4, 4) of the revolute joints about z, each in the frame of the
            previous link.
        q: joint positions (n, nq) [rad].
    """
    nq = q.shape[1]
    q, placements = np.ascontiguousarray(q, dtype=float), np.ascontiguousarray(placements)
    frames = np.empty((len(q), nq + 1, 4, 4))
    library.link_frames(len(q), nq, address(placements), address(q), address(frames))
    return frames
