"""Best-first subdivision of boxes, the driver of the branch-and-bound searches for lower bounds.

Boxes cover a set, for instance all joint positions at a pose. Every box has a lower bound on its
motions. The boxes of least bound are split repeatedly. The least bound over all boxes is a bound of
the whole set at any time, and it never decreases.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.rows import Rows
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem


@dataclass(frozen=True)
class SubdivisionSettings:
    """Settings of a best-first subdivision."""

    boxes_per_round: int = 400
    """Number of boxes split in a round."""
    rounds: int = 80
    """Largest number of rounds."""
    tight_rounds: int = 200
    """Largest number of rounds of a problem with `"bound": "tight"`."""
    early_rounds: int = 24
    """Number of rounds after which a bound within `tolerance` of the sufficient one is accepted."""
    tolerance: float = 0.1
    """Relative distance below the sufficient bound that is accepted after the early rounds."""


SUBDIVISION = SubdivisionSettings()


@dataclass(frozen=True)
class SearchLimits:
    """Limits on the effort of a search for a lower bound."""

    rounds: int = SUBDIVISION.rounds
    """Largest number of rounds."""
    deadline: Deadline = NEVER
    """Instant at which the search ends with the bound it has."""
    enough: float = np.inf
    """Sufficient bound [J]: the search ends once it is reached."""
    tolerance: float = 0.0
    """Relative distance below `enough` that is accepted after the early rounds."""

    @staticmethod
    def of(
        prepared: PreparedProblem, deadline: Deadline, enough: float, searches: int = 1
    ) -> SearchLimits:
        """Limits of one of several `searches` for a problem, with an equal share of the rounds."""
        if prepared.problem.bound == "tight":
            return SearchLimits(SUBDIVISION.tight_rounds // searches, deadline, enough)
        return SearchLimits(SUBDIVISION.rounds // searches, deadline, enough, SUBDIVISION.tolerance)

    def is_reached(self, bound: float, rounds: int) -> bool:
        """Whether a bound [J] suffices after a number of rounds."""
        if rounds >= SUBDIVISION.early_rounds and np.isfinite(self.enough):
            return bound >= self.enough - self.tolerance * abs(self.enough)
        return bound >= self.enough


DEFAULT_LIMITS = SearchLimits()


@dataclass(frozen=True)
class Bounded(Rows):
    """Parts of a set with their lower bounds."""

    value: Array
    """Lower bounds, shape (n,) [J]; inf for a part that is empty."""


@dataclass(frozen=True)
class Boxes(Bounded):
    """Boxes of joint positions, or tuples of boxes."""

    centre: Array
    """Middles, shape (n, …, nq) [rad]."""
    half: Array
    """Half sides, shape (n, …, nq) [rad]."""


B = TypeVar("B", bound=Bounded)


class Subdivision(ABC, Generic[B]):
    """Subdivision of a set into parts with lower bounds."""

    @abstractmethod
    def first(self) -> B:
        """Initial cover of the whole set."""

    @abstractmethod
    def chosen(self, parts: B, number: int) -> Indices:
        """Rows of the parts to split in a round; none ends the search.

        Args:
            parts: all parts, in ascending order of their bounds.
            number: number of rounds so far.
        """

    @abstractmethod
    def divided(self, parts: B, rows: Indices) -> B:
        """Split parts; the bounds of the results are no lower than the bounds of the given rows."""

    def run(self, limits: SearchLimits) -> B:
        """Cover of the set after best-first subdivision within limits."""
        parts = self.first()
        for number in range(limits.rounds):
            ascending = np.argsort(parts.value, kind="stable")
            parts = parts[ascending[parts.value[ascending] < np.inf]]
            rows = self.chosen(parts, number)
            if not len(rows) or limits.deadline.passed:
                break
            kept = np.ones(len(parts.value), dtype=bool)
            kept[rows] = False
            parts = parts[np.flatnonzero(kept)].joined(self.divided(parts, rows))
        return parts


BoxesT = TypeVar("BoxesT", bound=Boxes)


class BoxSubdivision(Subdivision[BoxesT]):
    """A set of joint positions in boxes, of which the least bound is wanted."""

    limits: SearchLimits

    @abstractmethod
    def is_settled(self, half: Array) -> bool:
        """Whether a box with these half sides, shape (…, nq) [rad], is too small to split."""

    def chosen(self, parts: BoxesT, number: int) -> Indices:
        """The boxes of least bound, unless it suffices or the first box is settled."""
        if (
            not len(parts.value)
            or self.limits.is_reached(float(parts.value[0]), number)
            or self.is_settled(parts.half[0])
        ):
            return np.zeros(0, dtype=np.intp)
        return np.arange(min(SUBDIVISION.boxes_per_round, len(parts.value)))

    def least_bound(self) -> float:
        """Lower bound of the whole set [J]; inf if it is empty."""
        return float(self.run(self.limits).value.min(initial=np.inf))
