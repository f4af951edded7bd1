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
from optimizer.kinematics.nearby_loops import loops
from optimizer.kinematics.redundant_pose import RedundantPose
from optimizer.kinematics.spherical_shoulder import SphericalShoulder

# distances [m] of poses beside one that is beyond the reach of the arm nearby, if only by what the two arms differ
BESIDE = (1e-3, 2e-3)


@dataclass(frozen=True, eq=False)
class NearbyArm:
    """The form of the arm nearby; `mirrored` if it is of this form from the flange on. `axes` are its own, from the
    flange on if it is mirrored."""

    form: SphericalShoulder
    mirrored: bool
    axes: JointAxes

    @classmethod
    def of(cls, chain: Chain) -> NearbyArm | None:
        """The arm near a chain of seven joints; None if there is none of this form."""
        simple = JointAxes.of(chain).simplified().chain()
        for mirrored, each in ((False, simple), (True, simple.mirrored())):
            form = SphericalShoulder.of_chain(each)
            if form is not None:
                return cls(form, mirrored, JointAxes.of(each))
        return None

    def loops(self, T: Array) -> tuple[list[Array], list[Array]]:
        """Points (m, 7) [rad] along loops on which the arm nearby holds its flange at T (4, 4), and along curves that
        are in none: see `nearby_loops`."""
        pose = RedundantPose(self.form, np.asarray(np.linalg.inv(T)) if self.mirrored else T)
        found, rest = loops(pose)
        # on the left shoulder, the third axis leans to the other side
        scale, shift = np.ones(7), np.zeros(7)
        scale[1], shift[:3] = -1.0, (np.pi, -2 * self.form.lean_at_zero, np.pi)
        if self.mirrored:
            # from the flange on, the joints come in the other order and turn the other way
            found, rest = [-q[:, ::-1] for q in found], [-q[:, ::-1] for q in rest]
            scale, shift = scale[::-1], -shift[::-1]
        return [*found, *(scale * q + shift for q in found)], [*rest, *(scale * q + shift for q in rest)]

    def beside(self, T: Array) -> list[Array]:
        """Points (m, 7) [rad] along the curves on which the arm nearby holds its flange beside T (4, 4), shifted along
        the axes of the base: there are some if T is beyond its reach by less than the arms differ."""
        found = list[Array]()
        for distance in BESIDE:
            for shift in distance * np.vstack([np.eye(3), -np.eye(3)]):
                near = T.copy()
                near[:3, 3] += shift
                closed, rest = self.loops(near)
                found += [*closed, *rest]
        return found
