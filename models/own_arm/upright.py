"""A chain whose joints turn about the z axes of their frames, the convention of all robots here."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.robot import UPRIGHT, Array

LEVEL = 1e-6
"""Deviation of gravity [m/s²] below which a base is upright: rounding of angles."""


@dataclass(frozen=True)
class UprightChain:
    """A chain with rotated link frames.

    `R` (nq + 1, 3, 3) are the axes of the link frames in the URDF's frames, base first.
    `placements` are the poses of the joint frames in the previous link frame, `flange` the pose of
    the tip in the last one, `inertias` the inertias of the moving links in their frames.
    """

    R: Array
    placements: tuple[pin.SE3, ...]
    flange: pin.SE3
    inertias: tuple[pin.Inertia, ...]

    @staticmethod
    def of(chain: Chain) -> UprightChain:
        """The same arm with rotated frames."""
        R = np.array([np.eye(3), *(turn_onto(axis) for axis in chain.axes)])
        # The base keeps its axes, wherever it is in the URDF.
        turns = [pin.SE3(chain.T_base), *(pin.SE3(each, np.zeros(3)) for each in R[1:])]
        placements = list(chain.model.jointPlacements)[1:]
        return UprightChain(
            R,
            tuple(turns[k].inverse() * each * turns[k + 1] for k, each in enumerate(placements)),
            turns[-1].inverse() * pin.SE3(chain.T_tip),
            tuple(
                turn.actInv(body)
                for turn, body in zip(turns[1:], list(chain.model.inertias)[1:], strict=True)
            ),
        )


def gravity_in_base(chain: Chain) -> Array | None:
    """Gravity (3,) [m/s²] in the base if the root link is upright; None for an upright base."""
    gravity = chain.T_base[:3, :3].T @ UPRIGHT
    return None if np.abs(gravity - UPRIGHT).max() < LEVEL else np.asarray(gravity)


def turn_onto(axis: Array) -> Array:
    """The rotation (3, 3) of least angle from the z axis to a unit vector (3,)."""
    x, y, z = axis
    if z < -0.5:
        # about x by half a turn, and on from there
        return np.asarray(np.diag([1.0, -1.0, -1.0]) @ turn_onto(np.array([x, -y, -z])))
    v = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    return np.asarray(np.eye(3) + v + v @ v / (1 + z))
