"""A quick bound on many moves: of the joint that has farthest to go, the others left out.

`LeastBound` rises with the displacement of every joint and with the gain of potential energy. So
its value where one joint alone moves, by no more than it does, and at no more than the gain, is a
bound. These values are looked up in a table with even steps, at the step below; the greatest over
all joints counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.deadline import end_if_stopped
from joulepath.optimizer.kinematics.angles import wrapped

# steps of displacement, up to so much [rad], and of gain
AWAY, FARTHEST, GAINS = 48, 4 * np.pi, 48
# joints that are looked up: those that make the greatest difference
JOINTS = 3


@dataclass(frozen=True)
class Boxes:
    """Boxes of middles and half sides (n, nq) [rad], and which joints (n, nq) have no other full
    turns.
    """

    centre: Array
    half: Array
    placed: Mask


class SingleJointBound:
    """The bounds for gains of potential energy from `low` to `high` [J]; less than `low` has
    none."""

    def __init__(self, bound: LeastBound, low: float, high: float) -> None:
        nq = bound.prepared.arm.robot.nq
        self.low, self.step = low, max(high - low, 1e-9) / (GAINS - 1)
        self.away = FARTHEST / (AWAY - 1)
        away, gain = np.meshgrid(
            self.away * np.arange(AWAY), low + self.step * np.arange(GAINS), indexing="ij"
        )
        alone = [away.reshape(-1, 1) * (np.arange(nq) == j) for j in range(nq)]
        tables = [bound.of(each, gain.ravel()).reshape(away.shape) for each in alone]
        order = np.argsort([-float(each.sum()) for each in tables])
        self.tables = {j: tables[j] for j in order[:JOINTS].tolist()}

    def between(self, start: Boxes, goal: Boxes, gain: Array) -> Array:
        """Bounds (s, g) [J] on moves from boxes to others, with least gains of potential energy (s,
        g) [J].
        """
        found, level = (
            np.full(gain.shape, -np.inf),
            np.floor((gain - self.low) / self.step).astype(np.intp),
        )
        known, level = level >= 0, np.clip(level, 0, GAINS - 1)
        for j, table in self.tables.items():
            end_if_stopped()
            apart = goal.centre[:, j] - start.centre[:, j][:, None]
            placed = start.placed[:, j][:, None] & goal.placed[:, j]
            apart = (
                np.abs(np.where(placed, apart, wrapped(apart)))
                - start.half[:, j][:, None]
                - goal.half[:, j]
            )
            row = np.clip(np.floor(apart / self.away), 0, AWAY - 1).astype(np.intp)
            found = np.maximum(found, table[row, level])
        return np.where(known, found, -np.inf)
