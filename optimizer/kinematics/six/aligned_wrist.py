"""Self-motion of a spherical wrist whose first and last axes coincide: both joints turn, the flange
stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True, eq=False)
class AlignedWrist:
    """Self-motion through a configuration q (6,) [rad] with coinciding fourth and sixth axes.

    The parameter is the position h of the fourth joint. The sixth joint turns against it if the
    axes have the same direction (`turn` -1), with it if they are opposed (`turn` 1): q6 = q[5] +
    turn (h - q[3]). The other joints rest.
    """

    label: BranchLabel
    q: Array
    turn: float

    free = (3, 5)

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """The whole circle [rad]."""
        return [(-np.pi, np.pi)]

    def parameter(self, q: Array) -> float:
        """Parameter h [rad] of q (6,)."""
        return self.clipped(float(q[3]))

    def clipped(self, parameter: float) -> float:
        """The parameter [rad], shifted by full turns into [-π, π]."""
        return float(nearest_turn(np.asarray(parameter), np.asarray(0.0)))

    def at(self, parameter: Array) -> Array:
        """Configurations (n, 6) [rad] at parameters (n,)."""
        q = self._unwrapped(np.asarray(parameter, dtype=float))
        return np.clip(wrapped(q), -np.pi, np.pi)

    def boxes(self, parameter: Array, half: Array) -> tuple[Array, Array]:
        """Boxes that cover the curve, see `SelfMotion.boxes`; exact, since both joints move by the
        parameter.
        """
        centre = self._unwrapped(np.asarray(parameter, dtype=float))
        half = np.asarray(half, dtype=float)
        sides = np.zeros_like(centre)
        sides[:, 3] = sides[:, 5] = half
        return centre, sides

    def _unwrapped(self, h: Array) -> Array:
        q = np.tile(self.q, (len(h), 1))
        q[:, 3], q[:, 5] = h, self.q[5] + self.turn * (h - self.q[3])
        return q
