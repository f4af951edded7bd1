"""Forward kinematics of n configurations at once."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.native.shared_library import address, library


def joint_placements(model: pin.Model) -> Array:
    """Poses (nq, 4, 4) of the joints of a chain, each in the frame of the link before it."""
    return np.array([placement.homogeneous for placement in model.jointPlacements][1:])


def link_frames(placements: Array, q: Array) -> Array:
    """T_base_link (n, nq + 1, 4, 4) for q (n, nq) [rad] of revolute joints about z at `placements`
    (nq, 4, 4).

    Frame 0 is that of the base, the identity. Frame k, of link k, lies on joint k with z along the
    joint's axis.
    """
    nq = q.shape[1]
    q, placements = np.ascontiguousarray(q, dtype=float), np.ascontiguousarray(placements)
    frames = np.empty((len(q), nq + 1, 4, 4))
    library.link_frames(len(q), nq, address(placements), address(q), address(frames))
    return frames
