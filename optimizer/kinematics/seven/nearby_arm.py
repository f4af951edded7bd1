"""Self-motions of the nearest arm of the form `SphericalShoulder`, read from the base or from the
flange.

Kinova's Gen3 is of this form from the flange, except for 0.35 mm between the axes of its wrist; a
calibrated Panda is from the base. The self-motions of the nearest simple arm (`joint_axes`) have a
closed form, and are near those of the arm itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.seven.redundant_arm import curves_of
from joulepath.optimizer.kinematics.seven.redundant_curve import members
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder


@dataclass(frozen=True)
class NearbyArmSettings:
    """Seeds along curves, and poses beside one out of reach."""

    seeds: int = 4
    """Number of seeds along each curve of the simple arm."""

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

    def seeds(self, T: Array) -> Array:
        """Configurations (n, 7) [rad] along all curves of the simple arm with its flange at
        T (4, 4).
        """
        pose = np.asarray(np.linalg.inv(T)) if self.mirrored else T
        share = (np.arange(SETTINGS.seeds) + 0.5) / SETTINGS.seeds
        curves = curves_of(RedundantPose(self.form, pose))
        if not curves:
            return np.zeros((0, 7))
        at = [low + share * (high - low) for curve in curves for low, high in curve.arcs]
        q = np.concatenate(members(curves, at))
        # From the flange, the joints come in reverse order and turn the other way.
        return -q[:, ::-1] if self.mirrored else q

    def beside(self, T: Array) -> Array:
        """Configurations (n, 7) [rad] of the simple arm at poses shifted from T (4, 4) along the
        base axes.

        There are some if T is beyond the reach of the simple arm by less than the two arms differ.
        """
        found = list[Array]()
        for distance in SETTINGS.shifts:
            for shift in distance * np.vstack([np.eye(3), -np.eye(3)]):
                near = T.copy()
                near[:3, 3] += shift
                found.append(self.seeds(near))
        return np.concatenate(found)
