"""Serial chain of an arm: flange poses, Jacobians, and the error of a pose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.coupling import UNCOUPLED, Coupling
from joulepath.models.robot import Array, flange_placement
from joulepath.optimizer.kinematics.forward import joint_placements


@dataclass(frozen=True)
class ForwardSettings:
    """Settings of forward kinematics and pose errors."""

    smallest_sine: float = 1e-12
    """Sine of a rotation below which its rotation vector is the skew part of the matrix: the angle
    over the sine is 1 to double precision.
    """
    small_batch: int = 16
    """Largest number of configurations for which a tree of matrix products is faster than one pass
    over the links with all configurations in a row.
    """


CHAIN = ForwardSettings()


@dataclass(frozen=True, eq=False)
class Chain:
    """Serial chain of revolute joints about z, with the flange fixed to the last link.

    `placements` (n, 4, 4) are the poses of the joints, each in the frame of the previous link. With
    a `coupling`, q are the positions of the nq ≤ n joints that follow no other.
    """

    placements: Array
    T_last_flange: Array
    coupling: Coupling = UNCOUPLED

    @classmethod
    def of(cls, model: pin.Model, coupling: Coupling = UNCOUPLED) -> Chain:
        """Chain of a Pinocchio model with a frame `flange`."""
        flange = flange_placement(model)
        return cls(joint_placements(model), np.asarray(flange.homogeneous), coupling)

    @property
    def nq(self) -> int:
        """Number of joints, without those that follow others."""
        return len(self.coupling.own) or len(self.placements)

    @cached_property
    def length(self) -> float:
        """Upper bound of the distance of the flange from the first joint's origin [m]."""
        links = [*self.placements[1:], self.T_last_flange]
        return float(sum(np.linalg.norm(link[:3, 3]) for link in links))

    def beyond_length(self, T: Array) -> float:
        """Distance [m] of the flange pose T (4, 4) beyond the stretched chain; a pose with a
        positive distance is out of reach.
        """
        return float(np.linalg.norm(T[:3, 3] - self.placements[0, :3, 3])) - self.length

    def mirrored(self) -> Chain:
        """The same chain read from the flange to the base.

        With the joint positions -q in reverse order, its flange pose is the pose of the base in the
        flange frame of this chain at q.
        """
        back = np.linalg.inv(np.concatenate([self.placements, self.T_last_flange[None]]))[::-1]
        return Chain(back[:-1], back[-1])

    def flange(self, q: Array) -> Array:
        """Flange poses T_base_flange (n, 4, 4) at q (n, nq) [rad]."""
        if len(q) > CHAIN.small_batch:
            return _poses(self.flange_components(q))
        harmonics, q = self._harmonics, self.coupling.positions(q)
        parts = np.cos(q)[..., None, None] * harmonics[0]
        parts += np.sin(q)[..., None, None] * harmonics[1]
        parts += harmonics[2]
        # A tree of products of neighbouring links needs the fewest calls for few configurations.
        while (count := parts.shape[1]) > 1:
            pairs = parts[:, : count - 1 : 2] @ parts[:, 1::2]
            parts = np.concatenate([pairs, parts[:, -1:]], axis=1) if count % 2 else pairs
        return np.asarray(parts[:, 0])

    @cached_property
    def _harmonics(self) -> Array:
        """Coefficients (3, nq, 4, 4) of cos q, sin q and 1 in the pose of each link in the frame of
        the previous one.

        The flange takes the place of the last link.
        """
        P = self.placements
        harmonics = np.zeros((3, *P.shape))
        harmonics[0, :, :, :2] = P[:, :, :2]
        harmonics[1, :, :, 0], harmonics[1, :, :, 1] = P[:, :, 1], -P[:, :, 0]
        harmonics[2, :, :, 2:] = P[:, :, 2:]
        harmonics[:, -1] = harmonics[:, -1] @ self.T_last_flange
        return harmonics

    def flange_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Flange poses T_base_flange (n, 4, 4) and geometric Jacobians (n, 6, nq) at q (n, nq)
        [rad].
        """
        flange, jacobian = self.flange_and_columns(q)
        return _poses(flange), np.ascontiguousarray(jacobian.transpose(2, 0, 1))

    def flange_and_columns(self, q: Array) -> tuple[Array, Array]:
        """Flange poses and Jacobians with the configurations along the last axes.

        One long product over all configurations replaces many small ones.

        Returns:
            The flange poses as `flange_components` (3, n, 4), and the Jacobians (6, nq, n).
        """
        frames, flange = self._frames(q)
        jacobian = np.empty((6, len(frames), len(q)))
        axis = jacobian[3:]
        axis[:] = frames[..., 2].transpose(1, 0, 2)
        u, v, w = flange[:, None, :, 3] - frames[..., 3].transpose(1, 0, 2)
        x, y, z = axis
        jacobian[0], jacobian[1], jacobian[2] = y * w - z * v, z * u - x * w, x * v - y * u
        if self.coupling.follows:
            jacobian = self.coupling.matrix.T @ jacobian
        return flange, jacobian

    def flange_components(self, q: Array) -> Array:
        """First three rows (3, n, 4) of the flange poses at q (n, nq) [rad]."""
        return self._frames(q)[1]

    def _frames(self, q: Array) -> tuple[Array, Array]:
        """First three rows of the poses of the links (nq, 3, n, 4) and of the flange (3, n, 4)."""
        q = self.coupling.positions(q)
        n, nq = q.shape
        turns, angles = np.empty((nq, n), dtype=complex), q.T
        turns.real, turns.imag = np.cos(angles), -np.sin(angles)
        frames = np.empty((nq, 3, n, 4))
        rows, across = frames.reshape(nq, 3 * n, 4), frames.view(complex)[..., 0]
        frames[0] = self.placements[0, :3, None]
        # x + iy of a frame that turns about its z axis is multiplied by exp(-iq)
        across[0] *= turns[0]
        for k in range(1, nq):
            np.matmul(rows[k - 1], self.placements[k], out=rows[k])
            np.multiply(across[k], turns[k], out=across[k])
        return frames, (rows[-1] @ self.T_last_flange).reshape(3, n, 4)


def _poses(frames: Array) -> Array:
    """Poses (n, 4, 4) from their first three rows (3, n, 4)."""
    T = np.empty((frames.shape[1], 4, 4))
    T[:, :3], T[:, 3] = frames.transpose(1, 0, 2), (0.0, 0.0, 0.0, 1.0)
    return T


def pose_error(T_reached: Array, T: Array) -> Array:
    """Twist (n, 6) [m, rad], in base axes, from poses T_reached (n, 4, 4) to the pose T.

    The translation is exact to first order, the rotation vector for all angles below a half turn. T
    has the shape (4, 4), or (n, 4, 4) for one pose per row.
    """
    error = np.empty((len(T_reached), 6))
    error[:, :3] = T[..., :3, 3] - T_reached[:, :3, 3]
    E = T[..., :3, :3] @ T_reached[:, :3, :3].transpose(0, 2, 1)
    axis = (
        np.stack(
            [E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0], E[:, 1, 0] - E[:, 0, 1]], axis=1
        )
        / 2
    )
    sine = np.sqrt((axis * axis).sum(axis=1))
    cosine = (E[:, 0, 0] + E[:, 1, 1] + E[:, 2, 2] - 1) / 2
    scale = np.where(
        sine > CHAIN.smallest_sine,
        np.arctan2(sine, cosine) / np.maximum(sine, CHAIN.smallest_sine),
        1.0,
    )
    error[:, 3:] = axis * scale[:, None]
    return error


def twist_size(error: Array) -> Array:
    """Size (n,) of twists (n, 6): the larger of the distance [m] and the angle [rad]."""
    squares = error * error
    return np.asarray(np.sqrt(np.maximum(squares[:, :3].sum(axis=1), squares[:, 3:].sum(axis=1))))
