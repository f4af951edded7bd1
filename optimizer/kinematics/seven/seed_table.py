"""Starts for Newton's method near a flange pose, from a table of configurations inside the joint
ranges.

The first joint turns the whole arm about its axis, the last one the flange about its own. So only
the joints between them are tabled, and a pose is looked up by what neither joint changes: where the
last axis is, and where it points, seen from the first axis and from its own azimuth. Both outer
angles then follow from the pose.
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

# configurations in the table, and of those how many are placed at a time
SIZE, AT_A_TIME = 16384, 1024
# rows of the table that are looked up, and starts that are made of them
LOOKED_UP, STARTS = 512, 96
# angle [rad] beyond its limit up to which an outer joint makes a start
BESIDE = 0.3


@dataclass(frozen=True, eq=False)
class SeedTable:
    """Configurations of a chain inside q_min … q_max (nq,) [rad], drawn evenly from a fixed
    seed."""

    chain: Chain
    q_min: Array
    q_max: Array

    def starts(self, T: Array) -> Array:
        """At most STARTS configurations (n, nq) [rad] whose flange is near the pose T (4, 4), the
        nearest first.
        """
        key, azimuth = self._keys(self._last_link(T[None]))
        rows: NDArray[np.intp] = np.asarray(self._tree.query(key[0], LOOKED_UP)[1])
        q = self._configurations[rows]
        q[:, 0] = nearest_turn(
            azimuth[0] - self._azimuths[rows], (self.q_min[0] + self.q_max[0]) / 2
        )
        # what is left of the rotation is, nearly, that of the last joint
        left = self.chain.flange(q)[:, :3, :3].transpose(0, 2, 1) @ T[:3, :3]
        R = self.chain.T_last_flange[:3, :3]
        left = R @ left @ R.T
        turn = np.arctan2(left[:, 1, 0] - left[:, 0, 1], left[:, 0, 0] + left[:, 1, 1])
        q[:, -1] = nearest_turn(turn, (self.q_min[-1] + self.q_max[-1]) / 2)
        inside = ((q > self.q_min - BESIDE) & (q < self.q_max + BESIDE)).all(axis=1)
        return np.asarray(q[inside][:STARTS])

    @cached_property
    def _configurations(self) -> Array:
        """The table (SIZE, nq) [rad], with outer joints at zero."""
        q = np.random.default_rng(0).uniform(self.q_min, self.q_max, (SIZE, self.chain.nq))
        q[:, [0, -1]] = 0.0
        return q

    @cached_property
    def _placed(self) -> tuple[Array, Array]:
        """Keys (SIZE, 5) and azimuths (SIZE,) [rad] of the table."""
        parts = [
            self._keys(self._last_link(self.chain.flange(self._configurations[k : k + AT_A_TIME])))
            for k in range(0, SIZE, AT_A_TIME)
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
        """What counts as a radian [m]: a length of the arm."""
        return float(np.linalg.norm(self.chain.placements[1:, :3, 3], axis=1).sum()) / 2

    def _last_link(self, T: Array) -> Array:
        """Poses (n, 4, 4) of the last link in the frame of the first joint, with the flange at T
        (n, 4, 4).
        """
        return np.asarray(
            np.linalg.inv(self.chain.placements[0]) @ T @ np.linalg.inv(self.chain.T_last_flange)
        )

    def _keys(self, X: Array) -> tuple[Array, Array]:
        """What the outer joints do not change (n, 5), and the azimuth (n,) [rad] of last links X
        (n, 4, 4).
        """
        x, y, z = X[:, :3, 3].T
        azimuth = np.arctan2(y, x)
        c, s = np.cos(azimuth), np.sin(azimuth)
        a, b, up = X[:, :3, 2].T
        return np.column_stack(
            [np.hypot(x, y) / self._length, z / self._length, c * a + s * b, c * b - s * a, up]
        ), azimuth
