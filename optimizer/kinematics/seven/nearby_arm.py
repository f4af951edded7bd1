"""What is near the curves of an arm that nearly has the form `SphericalShoulder`, from its base or
from its flange on.

Kinova's Gen3 is of this form from the flange on, but for 0.35 mm between the axes of its wrist; a
calibrated Panda is from the base on. The curves of the simplest arm nearby (`joint_axes`) are
known, and near those of the arm itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.seven.nearby_loops import Loops, loops
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder

# distances [m] of poses beside one that is beyond the reach of the arm nearby, if only by what the
# two arms differ
BESIDE = (1e-3, 2e-3)


@dataclass(frozen=True, eq=False)
class NearbyArm:
    """The form of the arm nearby; `mirrored` if it is of this form from the flange on. `axes` are
    its own, from the flange on if it is mirrored."""

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

    def loops(self, T: Array) -> tuple[Loops, list[Array]]:
        """Loops on which the arm nearby holds its flange at T (4, 4), and points (m, 7) [rad] along
        curves that are in none: see `nearby_loops`."""
        found, rest = loops(
            RedundantPose(self.form, np.asarray(np.linalg.inv(T)) if self.mirrored else T)
        )
        return Loops(self._both(found.points), 2 * found.counts), [
            self._both(each) for each in rest
        ]

    def _both(self, q: Array) -> Array:
        """The points q (m, 7) [rad] of the form on its right shoulder as ones (2m, 7) of the arm
        nearby: on it, then on the left one."""
        # on the left shoulder, the third axis leans to the other side
        scale, shift = self._left
        if self.mirrored:
            # from the flange on, the joints come in the other order and turn the other way
            q = -q[:, ::-1]
        return np.concatenate([q, scale * q + shift])

    @cached_property
    def _left(self) -> tuple[Array, Array]:
        """Factors (7,) and angles (7,) [rad] that lead from configurations on the right shoulder to
        those on the left one."""
        scale, shift = np.ones(7), np.zeros(7)
        scale[1], shift[:3] = -1.0, (np.pi, -2 * self.form.lean_at_zero, np.pi)
        return (scale[::-1], -shift[::-1]) if self.mirrored else (scale, shift)

    def beside(self, T: Array) -> list[Array]:
        """Points (m, 7) [rad] along the curves on which the arm nearby holds its flange beside T
        (4, 4), shifted along the axes of the base: there are some if T is beyond its reach by less
        than the arms differ."""
        found = list[Array]()
        for distance in BESIDE:
            for shift in distance * np.vstack([np.eye(3), -np.eye(3)]):
                near = T.copy()
                near[:3, 3] += shift
                closed, rest = self.loops(near)
                found += [*closed.each(), *rest]
        return found
