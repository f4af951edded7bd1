"""The pair of end configurations between which motions are bounded."""

from __future__ import annotations

from typing import Protocol

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration


class Pair(Protocol):
    """A start and a goal configuration with a choice of full turns; candidates of a search are
    pairs.
    """

    @property
    def start(self) -> EndConfiguration:
        """Branch at the start."""
        ...

    @property
    def goal(self) -> EndConfiguration:
        """Branch at the goal."""
        ...

    @property
    def q_start(self) -> Array:
        """Joint positions at the start, shape (nq,) [rad]."""
        ...

    @property
    def q_goal(self) -> Array:
        """Joint positions at the goal, shape (nq,) [rad]."""
        ...

    @property
    def sampled(self) -> bool:
        """Whether infinitely many configurations reach one of the ends."""
        ...
