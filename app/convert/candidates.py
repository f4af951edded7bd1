"""Candidates as an answer lists them: which ones, and how many have each status."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from joulepath.app.convert.fields import fields
from joulepath.app.schemas.request import WhichCandidates
from joulepath.optimizer.solution import CandidateReport, CandidateStatus

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


def candidate_counts(candidates: Sequence[CandidateReport]) -> dict[str, int]:
    """How many candidates have each status."""
    counted = Counter(each.status for each in candidates)
    return {status.value: counted[status] for status in CandidateStatus}


def most_telling(candidates: Sequence[CandidateReport]) -> list[CandidateReport]:
    """The candidates that an error document lists: those that explain most first, at most MOST_IN_A_PROBLEM."""
    return sorted(candidates, key=lambda each: _TELLING.index(each.status))[:MOST_IN_A_PROBLEM]


def candidate_fields(candidate: CandidateReport) -> dict[str, Any]:
    """One entry of `candidates`."""
    ends = ("start", "start_target", "goal", "goal_target", "q_start", "q_goal")
    return fields(candidate, *ends, "status", "reason", "lower_bound", "energy", "duration", "refined")
