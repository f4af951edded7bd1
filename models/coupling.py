"""Follower joints of a chain, as in the parallelogram of a palletiser."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Coupling:
    """Followers among the joints of a chain: q_chain = matrix · q + offset.

    A chain has n joints. The nq joints with a motor are the joints of the arm: positions q, limits,
    drives and torques refer to the joints of the arm. A follower turns with a joint of the arm, its
    leader.

    `rows` has one row per joint of the chain: the place of its leader in the chain, the multiplier
    [1] and the offset [rad]. A joint of the arm is its own leader. `rows` is empty for an arm
    without followers; every method then returns its argument.
    """

    rows: tuple[tuple[int, float, float], ...] = ()

    @property
    def follows(self) -> bool:
        """Whether any joint follows another."""
        return bool(self.rows)

    @property
    def is_periodic(self) -> bool:
        """Whether a full turn of a joint turns all its followers by full turns."""
        return all(float(multiplier).is_integer() for _, multiplier, _ in self.rows)

    @property
    def has_free_end(self) -> bool:
        """Whether the last joint of the chain is the arm's, and no other follows it."""
        last = len(self.rows) - 1
        return [leader for leader, _, _ in self.rows].count(last) == (1 if self.rows else 0)

    @cached_property
    def own(self) -> list[int]:
        """Places in the chain of the joints of the arm, shape (nq,)."""
        return [place for place, (leader, _, _) in enumerate(self.rows) if leader == place]

    @cached_property
    def leaders(self) -> list[int]:
        """Indices of the leaders of the chain's joints among the joints of the arm, shape (n,)."""
        return [self.own.index(leader) for leader, _, _ in self.rows]

    @cached_property
    def matrix(self) -> Array:
        """Derivatives (n, nq) of the chain's positions by positions of the arm's joints."""
        matrix = np.zeros((len(self.rows), len(self.own)))
        matrix[range(len(self.rows)), self.leaders] = [multiplier for _, multiplier, _ in self.rows]
        return matrix

    @cached_property
    def offset(self) -> Array:
        """Positions (n,) [rad] of the chain's joints with all joints of the arm at zero."""
        return np.array([offset for _, _, offset in self.rows])

    def positions(self, q: Array) -> Array:
        """Positions (..., n) [rad] of the chain's joints at q (..., nq) [rad]."""
        return np.asarray(q @ self.matrix.T + self.offset) if self.rows else q

    def rates(self, v: Array) -> Array:
        """Rates (..., n) of the chain's joints, of any order, from rates (..., nq) of the arm's."""
        return np.asarray(v @ self.matrix.T) if self.rows else v

    def on_arm(self, x: Array) -> Array:
        """Torques or derivatives (..., nq) of the arm's joints from (..., n) of the chain's joints.

        By virtual work, the torque of a follower acts on its leader, times the multiplier, and so
        does a derivative, by the chain rule.
        """
        return np.asarray(x @ self.matrix) if self.rows else x

    def reaches(self, half: Array) -> Array:
        """Greatest moves (..., n) of the chain's joints for moves (..., nq) of the arm's joints."""
        return np.asarray(half @ np.abs(self.matrix).T) if self.rows else half

    def most_on_arm(self, x: Array) -> Array:
        """Bounds (..., nq) on absolute derivatives by the arm's joints.

        Args:
            x: bounds on absolute derivatives by the chain's joints, shape (..., n).
        """
        return np.asarray(x @ np.abs(self.matrix)) if self.rows else x

    def of_links(self, x: Array) -> Array:
        """Values (n,) of the links of the chain from values (nq,) of the arm's joints."""
        return np.asarray(x[self.leaders]) if self.rows else x

    def of_motors(self, x: Array) -> Array:
        """Values (n,) of the chain's joints from values (nq,) of the arm's, zero for followers."""
        if not self.rows:
            return x
        result = np.zeros(len(self.rows))
        result[self.own] = x
        return result


UNCOUPLED = Coupling()
"""Of an arm whose joints follow no other."""
