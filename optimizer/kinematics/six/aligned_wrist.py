"""The self-motion of a spherical wrist with its first and last axis in one line: both joints turn,
the flange stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True, eq=False)
class AlignedWrist:
    """The self-motion through a configuration q (6,) [rad] with the fourth and the sixth axis in
    one line.

    The parameter is the fourth joint's position h. The sixth turns against it if the axes point the
    same way (`turn`
    -1), with it if they are opposed (`turn` 1): q6 = q[5] + turn (h - q[3]). The other joints rest.
    """

    label: BranchLabel
    q: Array
    turn: float

    free = (3, 5)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """The whole circle."""
        return [(-np.pi, np.pi)]

    def parameter(self, q: Array) -> float:
        """h [rad] of q (6,)."""
        return self.clipped(float(q[3]))

    def clipped(self, parameter: float) -> float:
        """The parameter [rad] without its full turns."""
        return float(nearest_turn(np.asarray(parameter), np.asarray(0.0)))

    def at(self, parameter: Array) -> Array:
        """The configurations (n, 6) [rad] at parameters (n,)."""
        q = self._unwrapped(np.asarray(parameter, dtype=float))
        return np.clip(wrapped(q), -np.pi, np.pi)

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """See `SelfMotion`. Both joints move as the parameter does: the boxes are exact."""
        centre, half = (
            self._unwrapped(np.asarray(parameter, dtype=float)),
            np.asarray(half, dtype=float),
        )
        sides = np.zeros_like(centre)
        sides[:, 3] = sides[:, 5] = half
        return centre, sides

    def _unwrapped(self, h: Array) -> Array:
        q = np.tile(self.q, (len(h), 1))
        q[:, 3], q[:, 5] = h, self.q[5] + self.turn * (h - self.q[3])
        return q
