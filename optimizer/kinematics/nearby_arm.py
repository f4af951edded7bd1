"""Starts for the curves of an arm that is nearly of the form `SphericalShoulder`, from its base or from its flange on.

Kinova's Gen3 is of this form from the flange on, but for 0.35 mm between the axes of its wrist; a calibrated Panda is
from the base on. The curves of the simplest arm nearby (`joint_axes`) are known. Points spread over all of them are
near those of the arm itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.kinematics.chain import Chain
from optimizer.kinematics.joint_axes import JointAxes
from optimizer.kinematics.redundant_arm import RedundantArm
from optimizer.kinematics.redundant_curve import RedundantCurve, members
from optimizer.kinematics.spherical_shoulder import SphericalShoulder

# starts on each curve of the arm nearby: two of them make a loop, mostly
STARTS = 4


@dataclass(frozen=True, eq=False)
class NearbyArm:
    """The closed form of the arm nearby; `mirrored` if it is of this form from the flange on. `axes` are its own, from
    the flange on if it is mirrored."""

    arm: RedundantArm
    mirrored: bool
    axes: JointAxes

    @classmethod
    def of(cls, chain: Chain) -> NearbyArm | None:
        """The arm near a chain of seven joints; None if there is none of this form."""
        simple = JointAxes.of(chain).simplified().chain()
        for mirrored, each in ((False, simple), (True, simple.mirrored())):
            form = SphericalShoulder.of_chain(each)
            if form is not None:
                return cls(RedundantArm(form), mirrored, JointAxes.of(each))
        return None

    def starts(self, T: Array) -> Array:
        """Configurations (n, 7) [rad] of the arm nearby with its flange at T (4, 4), spread over all curves."""
        motions = self.arm.self_motions(np.asarray(np.linalg.inv(T)) if self.mirrored else T)
        curves = [each for each in motions if isinstance(each, RedundantCurve)]
        if not curves:
            return np.zeros((0, 7))
        share = (np.arange(STARTS) + 0.5) / STARTS
        q = np.vstack(members(curves, [low + (high - low) * share for low, high in (each.arcs[0] for each in curves)]))
        # from the flange on, the joints come in the other order and turn the other way
        return -q[:, ::-1] if self.mirrored else q
