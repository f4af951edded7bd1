"""Seeds of Newton's method near a flange pose, from a table of configurations within the joint
ranges.

The first joint turns the whole arm about its axis, the last one the flange about its own axis. So
only the joints between them are tabulated, and a pose is looked up by the invariants of both turns:
position and direction of the last axis, relative to the first axis and to the azimuth of the
flange. Both outer angles then follow from the pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.chain import Chain


@dataclass(frozen=True)
class SeedTableSettings:
    """Size of the table and number of seeds."""

    size: int = 16384
    """Number of tabulated configurations."""
    batch: int = 1024
    """Number of configurations whose poses are computed at a time."""
    neighbours: int = 512
    """Number of rows that are looked up."""
    seeds: int = 96
    """Largest number of seeds made from these rows."""
    beyond_limit: float = 0.3
    """Largest angle of an outer joint beyond its limit in a seed [rad]."""


SETTINGS = SeedTableSettings()


@dataclass(frozen=True, eq=False)
class SeedTable:
    """Configurations of a chain within q_min … q_max (nq,) [rad], drawn uniformly with a fixed
    seed.
    """

    chain: Chain
    q_min: Array
    q_max: Array

    def starts(self, T: Array) -> Array:
        """Configurations (n, nq) [rad] with a flange near the pose T (4, 4), nearest first."""
        key, azimuth = self._keys(self._last_link(T[None]))
        rows: NDArray[np.intp] = np.asarray(self._tree.query(key[0], SETTINGS.neighbours)[1])
        q = self._configurations[rows]
        q[:, 0] = nearest_turn(
            azimuth[0] - self._azimuths[rows], (self.q_min[0] + self.q_max[0]) / 2
        )
        # The remaining rotation is, nearly, about the last axis.
        left = self.chain.flange(q)[:, :3, :3].transpose(0, 2, 1) @ T[:3, :3]
        R = self.chain.T_last_flange[:3, :3]
        left = R @ left @ R.T
        turn = np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1])
        q[:, -1] = nearest_turn(turn, (self.q_min[-1] + self.q_max[-1]) / 2)
        inside = (
            (q > self.q_min - SETTINGS.beyond_limit) & (q < self.q_max + SETTINGS.beyond_limit)
        ).all(axis=1)
        return np.asarray(q[inside][: SETTINGS.seeds])

    @cached_property
    def _configurations(self) -> Array:
        """Tabulated configurations (size, nq) [rad], with outer joints at zero."""
        q = np.random.default_rng(0).uniform(self.q_min, self.q_max, (SETTINGS.size, self.chain.nq))
        q[:, [0, -1]] = 0.0
        return q

    @cached_property
    def _placed(self) -> tuple[Array, Array]:
        """Keys (size, 5) and azimuths (size,) [rad] of the table."""
        parts = [
            self._keys(
                self._last_link(self.chain.flange(self._configurations[k : k + SETTINGS.batch]))
            )
            for k in range(0, SETTINGS.size, SETTINGS.batch)
        ]
        return np.vstack([key for key, _ in parts]), np.concatenate(
            [azimuth for _, azimuth in parts]
        )

    @property
    def _azimuths(self) -> Array:
        return self._placed[1]

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self._placed[0])

    @cached_property
    def _length(self) -> float:
        """Length [m] that counts as one radian: half the length of the arm."""
        return float(np.linalg.norm(self.chain.placements[1:, :3, 3], axis=1).sum()) / 2

    def _last_link(self, T: Array) -> Array:
        """Poses (n, 4, 4) of the last link in the frame of the first joint, for flange poses T (n,
        4, 4).
        """
        return np.asarray(
            np.linalg.inv(self.chain.placements[0]) @ T @ np.linalg.inv(self.chain.T_last_flange)
        )

    def _keys(self, X: Array) -> tuple[Array, Array]:
        """Invariants (n, 5) of the outer joints, and azimuths (n,) [rad], of last links X (n, 4,
        4).
        """
        x, y, z = X[:, :3, 3].T
        azimuth = np.arctan2(y, x)
        c, s = np.cos(azimuth), np.sin(azimuth)
        a, b, up = X[:, :3, 2].T
        return np.column_stack(
            [np.hypot(x, y) / self._length, z / self._length, c * a + s * b, c * b - s * a, up]
        ), azimuth
