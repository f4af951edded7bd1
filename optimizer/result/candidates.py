"""Candidates of a search and their outcomes, and targets without candidates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, NamedTuple, TypedDict

from joulepath.optimizer.declared import (
    Count,
    Internal,
    Joules,
    NullIfNotFinite,
    PerJoint,
    Seconds,
    Unit,
)


@dataclass(frozen=True)
class UnreachableTarget:
    """A target of an `any_of` out of the arm's reach. It has no candidates."""

    end: str
    """Owner of the target: `start` or `goal`; of `POST /cycle` `start`, or `stops/` and a name."""
    target: int
    """Index in `any_of`, from 0."""
    reason: str
    """Why the target cannot be reached, and how to correct it."""


class CandidateStatus(StrEnum):
    """Outcome of a candidate."""

    SOLVED = "solved"
    PRUNED = "pruned"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    UNVISITED = "unvisited"


class CandidateCounts(TypedDict):
    """Number of candidates by status, listed or not."""

    solved: Count
    """A motion was found."""
    pruned: Count
    """Ruled out by the lower bound or by the energy."""
    infeasible: Count
    """No motion exists, at least none of this method."""
    failed: Count
    """No motion was found, but one may exist."""
    unvisited: Count
    """Not solved."""


class CandidateReport(NamedTuple):
    """One pair of a start and a goal configuration, and the result of the search for it."""

    # An answer has thousands of candidates; a frozen dataclass takes four times as long to create.
    start: str
    """Branch at the start."""
    start_target: int
    """Index in the `any_of` of the start, from 0; 0 for a single target."""
    goal: str
    """Branch at the goal."""
    goal_target: int
    """Index in the `any_of` of the goal, from 0; 0 for a single target."""
    q_start: Annotated[PerJoint, Unit("rad")]
    """Joint positions at the start."""
    q_goal: Annotated[PerJoint, Unit("rad")]
    """Joint positions at the goal."""
    status: CandidateStatus
    """`solved`: a motion was found. `pruned`: ruled out by its lower bound or by its energy.
    `infeasible`: has no motion, at least none of this method. `failed`: no motion was found, but
    one may exist. `unvisited`: not solved."""
    reason: str
    """Reason for the status, in words."""
    lower_bound: Annotated[Joules, NullIfNotFinite]
    """Lower bound of the objective for this pair of configurations; null if no motion exists or
    none was computed."""
    energy: Joules | None = None
    """Energy of the motion found, of the objective; null if not solved."""
    duration: Seconds | None = None
    """Duration of the motion found; null if not solved."""
    refined: bool | None = None
    """Whether the motion was optimised to the end. Otherwise its energy is that of a first, coarse
    motion: a request for this pair alone may find a few percent less. Null if not solved.
    """
    tried: Annotated[bool, Internal] = False
    """Whether a motion was computed, found or not."""


def count_by_status(candidates: Sequence[CandidateReport]) -> CandidateCounts:
    """Number of candidates by status."""
    counted = Counter(each.status for each in candidates)
    return CandidateCounts(
        solved=counted[CandidateStatus.SOLVED],
        pruned=counted[CandidateStatus.PRUNED],
        infeasible=counted[CandidateStatus.INFEASIBLE],
        failed=counted[CandidateStatus.FAILED],
        unvisited=counted[CandidateStatus.UNVISITED],
    )
