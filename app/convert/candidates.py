"""Candidates as an answer lists them: which ones, and how many have each status."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.app.schemas.request import WhichCandidates
from joulepath.optimizer.result.candidates import CandidateReport


def chosen(candidates: Sequence[CandidateReport], which: WhichCandidates) -> list[CandidateReport]:
    """The candidates that an answer lists, in their order."""
    if which == "none":
        return []
    return [each for each in candidates if which == "all" or each.tried]
