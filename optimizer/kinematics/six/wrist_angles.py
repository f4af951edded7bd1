"""Angles of a nearly aligned spherical wrist, and its self-motion if it is aligned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.forward import link_frames
from joulepath.optimizer.kinematics.six.aligned_wrist import AlignedWrist
from joulepath.optimizer.kinematics.six.spherical_wrist import SPHERICAL_WRIST, SphericalWrist


@dataclass(frozen=True)
class WristAnglesSettings:
    """Correction of the first three joints before the wrist is solved."""

    corrections: int = 2
    """Number of Newton steps that correct the last digits of the wrist's position."""
    least_singular_value: float = 1e-6
    """Singular value, relative to the largest, below which a correction leaves its direction alone,
    as with a stretched elbow.
    """


WRIST_ANGLES = WristAnglesSettings()


@dataclass(frozen=True, eq=False)
class WristAngles:
    """Last three joints of an arm with a spherical wrist, from the first three and a pose."""

    chain: Chain
    wrist: SphericalWrist

    def sines(self, frames: Array, T: Array) -> Array:
        """Sines (n,) of the angle between the fourth axis and the sixth.

        The fourth axis is taken from link frames (n, 7, 4, 4), the sixth from the flange pose T (4,
        4).
        """
        return np.asarray(
            np.linalg.norm(np.cross(frames[:, 4, :3, 2], T[:3, :3] @ self.wrist.last_axis), axis=1)
        )

    def near_alignment(self, arm: Array, T: Array) -> list[Array] | AlignedWrist:
        """Configurations of the wrist for given first joints and orientation.

        Each angle comes from an atan2 of two exact lengths, so that it is as accurate as the pose
        allows.

        Args:
            arm: first three joints (3,) [rad].
            T: flange pose (4, 4).

        Returns:
            Two configurations (6,) [rad], or the self-motion of an aligned wrist.
        """
        arm = self._placed(arm, T)
        at_zero = self._frames(arm, 0.0, 0.0)
        fourth, sixth = at_zero[4, :3, 2], T[:3, :3] @ self.wrist.last_axis
        across = np.cross(fourth, sixth)
        sine, along = float(np.linalg.norm(across)), float(fourth @ sixth) > 0
        if sine < SPHERICAL_WRIST.aligned:
            q = self._turned(arm, 0.0, float(self.wrist.bent(0.0, along)[0]), T)
            return AlignedWrist(self.wrist.label(q), q, -1.0 if along else 1.0)
        found = []
        for q5 in self.wrist.bent(sine, along).tolist():
            # With q4 = 0 the sixth axis is bent to one side; q4 turns it about the fourth axis to
            # its place.
            bent = np.cross(fourth, self._frames(arm, 0.0, q5)[6, :3, 2])
            q4 = np.arctan2(float(np.cross(bent, across) @ fourth), float(bent @ across))
            found.append(self._turned(arm, float(q4), q5, T))
        return found

    def beside_fold(self, q: Array, step: float) -> list[Array]:
        """Configurations (6,) [rad] on both sides of q, moved by `step` [rad] along the direction
        that moves the wrist least.
        """
        null = np.linalg.svd(self._wrist_and_jacobian(q[:3])[1])[2][-1]
        return [q + side * step * np.append(null, np.zeros(3)) for side in (1, -1)]

    def _placed(self, arm: Array, T: Array) -> Array:
        """First three joints (3,) [rad], corrected to the last digit of the wrist's position.

        A nearly aligned wrist amplifies their error.
        """
        goal = T[:3, :3] @ self.wrist.wrist + T[:3, 3]
        for _ in range(WRIST_ANGLES.corrections):
            reached, jacobian = self._wrist_and_jacobian(arm)
            arm = (
                arm
                + np.linalg.lstsq(
                    jacobian, goal - reached, rcond=WRIST_ANGLES.least_singular_value
                )[0]
            )
        return arm

    def _wrist_and_jacobian(self, arm: Array) -> tuple[Array, Array]:
        """Position (3,) [m] of the wrist at the first three joints (3,) [rad], and its Jacobian (3,
        3).
        """
        frames = self._frames(arm, 0.0, 0.0)
        flange = frames[6] @ self.chain.T_last_flange
        wrist = flange[:3, :3] @ self.wrist.wrist + flange[:3, 3]
        return wrist, np.cross(frames[1:4, :3, 2], wrist - frames[1:4, :3, 3]).T

    def _turned(self, arm: Array, q4: float, q5: float, T: Array) -> Array:
        """Configuration (6,) [rad] with the last joint turned to the orientation of T (4, 4)."""
        reached = (self._frames(arm, q4, q5)[6] @ self.chain.T_last_flange)[:3, :3]
        # Rotation about the last axis, in flange axes.
        R, axis = reached.T @ T[:3, :3], self.wrist.last_axis
        skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        return np.array([*arm, q4, q5, np.arctan2(float(skew @ axis), float(np.trace(R)) - 1)])

    def _frames(self, arm: Array, q4: float, q5: float) -> Array:
        return np.asarray(link_frames(self.chain.placements, np.array([[*arm, q4, q5, 0.0]]))[0])
