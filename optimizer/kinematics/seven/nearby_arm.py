"""Self-motions of the nearest arm of the form `SphericalShoulder`, read from the base or from the
flange.

Kinova's Gen3 is of this form from the flange, except for 0.35 mm between the axes of its wrist; a
calibrated Panda is from the base. The self-motions of the nearest simple arm (`joint_axes`) have a
closed form, and are near those of the arm itself.
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


@dataclass(frozen=True)
class NearbyArmSettings:
    """Poses beside one out of reach."""

    shifts: tuple[float, ...] = (1e-3, 2e-3)
    """Distances of poses beside one that only the exact arm reaches, because the two arms differ
    [m].
    """


SETTINGS = NearbyArmSettings()


@dataclass(frozen=True, eq=False)
class NearbyArm:
    """Closed form of the nearest simple arm.

    `mirrored` arms have this form from the flange. `axes` are those of the simple arm, from the
    flange if it is mirrored.
    """

    form: SphericalShoulder
    mirrored: bool
    axes: JointAxes

    @classmethod
    def of(cls, chain: Chain) -> NearbyArm | None:
        """Simple arm near a chain of seven joints; None if it has not this form."""
        simple = JointAxes.of(chain).simplified().chain()
        for mirrored, each in ((False, simple), (True, simple.mirrored())):
            form = SphericalShoulder.of_chain(each)
            if form is not None:
                return cls(form, mirrored, JointAxes.of(each))
        return None

    def loops(self, T: Array) -> tuple[Loops, list[Array]]:
        """Closed curves of the simple arm with its flange at T (4, 4), see `nearby_loops`.

        Returns:
            The closed curves, and points (m, 7) [rad] along each of the other curves.
        """
        found, rest = loops(
            RedundantPose(self.form, np.asarray(np.linalg.inv(T)) if self.mirrored else T)
        )
        return Loops(self._both_shoulders(found.points), 2 * found.counts), [
            self._both_shoulders(each) for each in rest
        ]

    def _both_shoulders(self, q: Array) -> Array:
        """Points q (m, 7) [rad] on the right shoulder as configurations (2m, 7) of the simple arm:
        on the right shoulder, then on the left one.
        """
        # With the left shoulder the third axis leans to the other side.
        scale, shift = self._left
        if self.mirrored:
            # From the flange, the joints come in reverse order and turn the other way.
            q = -q[:, ::-1]
        return np.concatenate([q, scale * q + shift])

    @cached_property
    def _left(self) -> tuple[Array, Array]:
        """Factors (7,) and offsets (7,) [rad] from configurations on the right shoulder to the left
        one.
        """
        scale, shift = np.ones(7), np.zeros(7)
        scale[1], shift[:3] = -1.0, (np.pi, -2 * self.form.lean_at_zero, np.pi)
        return (scale[::-1], -shift[::-1]) if self.mirrored else (scale, shift)

    def beside(self, T: Array) -> list[Array]:
        """Points (m, 7) [rad] along the curves of the simple arm at poses shifted from T (4, 4)
        along the base axes.

        There are some if T is beyond the reach of the simple arm by less than the two arms differ.
        """
        found = list[Array]()
        for distance in SETTINGS.shifts:
            for shift in distance * np.vstack([np.eye(3), -np.eye(3)]):
                near = T.copy()
                near[:3, 3] += shift
                closed, rest = self.loops(near)
                found += [*closed.each(), *rest]
        return found
