"""The chain of an arm for its inverse kinematics: flange poses, Jacobians, and the error against a
pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements

# sine of an angle below which its axis is taken from the sine alone
_TINY = 1e-12
# configurations up to which products of neighbours take less time than all in a row, link by link
FEW = 16


@dataclass(frozen=True, eq=False)
class Chain:
    """Joints about z at `placements` (nq, 4, 4), each in the frame of the link before, and the
    flange on the last.
    """

    placements: Array
    T_last_flange: Array

    @classmethod
    def of(cls, model: pin.Model) -> Chain:
        """The chain of a model with a frame `flange`."""
        flange = model.frames[model.getFrameId("flange")].placement
        return cls(joint_placements(model), np.asarray(flange.homogeneous))

    @property
    def nq(self) -> int:
        """Number of joints."""
        return len(self.placements)

    def mirrored(self) -> Chain:
        """The chain from the flange to the base.

        With -q in the other order, it has the base where q has the flange, each seen from the other
        end.
        """
        back = np.linalg.inv(np.concatenate([self.placements, self.T_last_flange[None]]))[::-1]
        return Chain(back[:-1], back[-1])

    def flange(self, q: Array) -> Array:
        """T_base_flange (n, 4, 4) at q (n, nq) [rad]."""
        if len(q) > FEW:
            return _poses(self.flange_components(q))
        waves = self._waves
        parts = np.cos(q)[..., None, None] * waves[0]
        parts += np.sin(q)[..., None, None] * waves[1]
        parts += waves[2]
        # products of neighbours, and so on: few calls for few configurations
        while (count := parts.shape[1]) > 1:
            pairs = parts[:, : count - 1 : 2] @ parts[:, 1::2]
            parts = np.concatenate([pairs, parts[:, -1:]], axis=1) if count % 2 else pairs
        return np.asarray(parts[:, 0])

    @cached_property
    def _waves(self) -> Array:
        """Coefficients (3, nq, 4, 4) of cos q, sin q and 1 in the pose of each link in the frame
        before it.

        The flange stands for the last link.
        """
        P = self.placements
        waves = np.zeros((3, *P.shape))
        waves[0, :, :, :2] = P[:, :, :2]
        waves[1, :, :, 0], waves[1, :, :, 1] = P[:, :, 1], -P[:, :, 0]
        waves[2, :, :, 2:] = P[:, :, 2:]
        waves[:, -1] = waves[:, -1] @ self.T_last_flange
        return waves

    def flange_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        """T_base_flange (n, 4, 4) at q (n, nq) [rad], and its geometric Jacobian (n, 6, nq)."""
        flange, jacobian = self.flange_and_columns(q)
        return _poses(flange), np.ascontiguousarray(jacobian.transpose(2, 0, 1))

    def flange_and_columns(self, q: Array) -> tuple[Array, Array]:
        """The same with all configurations in a row, for long products in place of many small ones:
        `flange_components` (3, n, 4), and the Jacobian (6, nq, n)."""
        frames, flange = self._frames(q)
        jacobian = np.empty((6, *q.shape[::-1]))
        axis = jacobian[3:]
        axis[:] = frames[..., 2].transpose(1, 0, 2)
        u, v, w = flange[:, None, :, 3] - frames[..., 3].transpose(1, 0, 2)
        x, y, z = axis
        jacobian[0], jacobian[1], jacobian[2] = y * w - z * v, z * u - x * w, x * v - y * u
        return flange, jacobian

    def flange_components(self, q: Array) -> Array:
        """x, y, z and the place of the flange by components (3, n, 4), at q (n, nq) [rad]."""
        return self._frames(q)[1]

    def _frames(self, q: Array) -> tuple[Array, Array]:
        """The links' frames (nq, 3, n, 4) and the flange's (3, n, 4) at q (n, nq) [rad], as of
        `flange_and_columns`.
        """
        n, nq = q.shape
        turns, angles = np.empty((nq, n), dtype=complex), q.T
        turns.real, turns.imag = np.cos(angles), -np.sin(angles)
        frames = np.empty((nq, 3, n, 4))
        rows, across = frames.reshape(nq, 3 * n, 4), frames.view(complex)[..., 0]
        frames[0] = self.placements[0, :3, None]
        # x + iy of a frame turned about its z
        across[0] *= turns[0]
        for k in range(1, nq):
            np.matmul(rows[k - 1], self.placements[k], out=rows[k])
            np.multiply(across[k], turns[k], out=across[k])
        return frames, (rows[-1] @ self.T_last_flange).reshape(3, n, 4)


def _poses(frames: Array) -> Array:
    """Poses (n, 4, 4) by their components (3, n, 4)."""
    T = np.empty((frames.shape[1], 4, 4))
    T[:, :3], T[:, 3] = frames.transpose(1, 0, 2), (0.0, 0.0, 0.0, 1.0)
    return T


def pose_error(T_reached: Array, T: Array) -> Array:
    """Twist (n, 6) [m, rad] in base axes that carries poses T_reached (n, 4, 4) to T (4, 4) or (n,
    4, 4): to first order in the translation, exactly in the rotation but for half turns."""
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
    scale = np.where(sine > _TINY, np.arctan2(sine, cosine) / np.maximum(sine, _TINY), 1.0)
    error[:, 3:] = axis * scale[:, None]
    return error


def miss(error: Array) -> Array:
    """The greater (n,) of distance [m] and angle [rad] of twists (n, 6)."""
    squares = error * error
    return np.asarray(np.sqrt(np.maximum(squares[:, :3].sum(axis=1), squares[:, 3:].sum(axis=1))))
