"""Candidates as an answer lists them: which ones, and how many have each status."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from joulepath.app.schemas.request import WhichCandidates
from joulepath.optimizer.result.candidates import CandidateCounts, CandidateReport, CandidateStatus

MOST_IN_A_PROBLEM = 64
"""Candidates that an error document lists at most. A search can have thousands, most of them for the same reason."""
_TELLING = (
    CandidateStatus.FAILED,
    CandidateStatus.INFEASIBLE,
    CandidateStatus.UNVISITED,
    CandidateStatus.SOLVED,
    CandidateStatus.PRUNED,
)
"""The order in which the reasons of candidates explain an error."""


def chosen(candidates: Sequence[CandidateReport], which: WhichCandidates) -> list[CandidateReport]:
    """The candidates that an answer lists, in their order."""
    if which == "none":
        return []
    return [each for each in candidates if which == "all" or each.tried]


def candidate_counts(candidates: Sequence[CandidateReport]) -> CandidateCounts:
    """How many candidates have each status."""
    counted = Counter(each.status for each in candidates)
    return CandidateCounts(
        solved=counted[CandidateStatus.SOLVED],
        pruned=counted[CandidateStatus.PRUNED],
        infeasible=counted[CandidateStatus.INFEASIBLE],
        failed=counted[CandidateStatus.FAILED],
        unvisited=counted[CandidateStatus.UNVISITED],
    )


def most_telling(candidates: Sequence[CandidateReport]) -> list[CandidateReport]:
    """The candidates that an error document lists: those that explain most first, at most MOST_IN_A_PROBLEM."""
    return sorted(candidates, key=lambda each: _TELLING.index(each.status))[:MOST_IN_A_PROBLEM]
