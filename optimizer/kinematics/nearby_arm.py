"""What is near the curves of an arm that nearly has the form `SphericalShoulder`, from its base or from its flange on.

Kinova's Gen3 is of this form from the flange on, but for 0.35 mm between the axes of its wrist; a calibrated Panda is
from the base on. The curves of the simplest arm nearby (`joint_axes`) are known, and near those of the arm itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.kinematics.chain import Chain
from optimizer.kinematics.joint_axes import JointAxes
from optimizer.kinematics.nearby_loops import STEPS, loops
from optimizer.kinematics.redundant_arm import RedundantArm
from optimizer.kinematics.redundant_curve import RedundantCurve
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

    def loops(self, T: Array) -> tuple[list[Array], Array]:
        """Points (m, 7) [rad] along loops on which the arm nearby holds its flange at T (4, 4): see `nearby_loops`; and
        configurations (n, 7) spread over the curves that are in none."""
        motions = self.arm.self_motions(np.asarray(np.linalg.inv(T)) if self.mirrored else T)
        found, rest = loops([each for each in motions if isinstance(each, RedundantCurve)])
        q = np.vstack([np.zeros((0, 7)), *(spread_over(each) for each in rest)])
        # from the flange on, the joints come in the other order and turn the other way
        return ([-each[:, ::-1] for each in found], -q[:, ::-1]) if self.mirrored else (found, q)


def spread_over(points: Array) -> Array:
    """Starts (n, nq) among the points (m, nq) along curves of the arm nearby: STARTS on each."""
    count = STARTS * max(len(points) // STEPS, 1)
    return np.asarray(points[((np.arange(count) + 0.5) * len(points) / count).astype(int)])
