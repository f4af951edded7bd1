"""Quick lower bound of many moves: the greatest bound of a single moving joint.

`LeastBound` is monotone in the displacement of every joint and in the gain of potential energy. Its
value with one joint moving alone, by at most its displacement and at most the gain, is therefore a
bound. The values are looked up in a table with even steps, at the step below. The greatest value
over the joints counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.deadline import end_if_stopped
from joulepath.optimizer.kinematics.angles import wrapped


@dataclass(frozen=True)
class SingleJointSettings:
    """Settings of the table of single-joint bounds."""

    displacements: int = 48
    """Number of displacements."""
    farthest: float = 4 * np.pi
    """Greatest displacement [rad]."""
    gains: int = 48
    """Number of gains of potential energy."""
    joints: int = 3
    """Number of joints with a table: those with the greatest bounds."""


TABLE = SingleJointSettings()


@dataclass(frozen=True)
class Boxes:
    """Boxes of joint positions.

    Attributes:
        centre: middle of every box, shape (n, nq) [rad].
        half: half sides, shape (n, nq) [rad].
        placed: joints with a definite full turn, shape (n, nq).
    """

    centre: Array
    half: Array
    placed: Mask


class SingleJointBound:
    """Bounds for gains of potential energy from `low` to `high` [J]; below `low` there is no
    bound.
    """

    def __init__(self, bound: LeastBound, low: float, high: float) -> None:
        nq = bound.prepared.arm.robot.nq
        self.low, self.step = low, max(high - low, 1e-9) / (TABLE.gains - 1)
        self.away = TABLE.farthest / (TABLE.displacements - 1)
        away, gain = np.meshgrid(
            self.away * np.arange(TABLE.displacements),
            low + self.step * np.arange(TABLE.gains),
            indexing="ij",
        )
        alone = [away.reshape(-1, 1) * (np.arange(nq) == j) for j in range(nq)]
        tables = [bound.of(each, gain.ravel()).reshape(away.shape) for each in alone]
        order = np.argsort([-float(each.sum()) for each in tables])
        self.tables = {j: tables[j] for j in order[: TABLE.joints].tolist()}

    def between(self, start: Boxes, goal: Boxes, gain: Array) -> Array:
        """Bounds (s, g) [J] of moves between boxes, with least gains (s, g) [J] of potential
        energy.
        """
        found, level = (
            np.full(gain.shape, -np.inf),
            np.floor((gain - self.low) / self.step).astype(np.intp),
        )
        known, level = level >= 0, np.clip(level, 0, TABLE.gains - 1)
        for j, table in self.tables.items():
            end_if_stopped()
            apart = goal.centre[:, j] - start.centre[:, j][:, None]
            placed = start.placed[:, j][:, None] & goal.placed[:, j]
            apart = (
                np.abs(np.where(placed, apart, wrapped(apart)))
                - start.half[:, j][:, None]
                - goal.half[:, j]
            )
            row = np.clip(np.floor(apart / self.away), 0, TABLE.displacements - 1).astype(np.intp)
            found = np.maximum(found, table[row, level])
        return np.where(known, found, -np.inf)
