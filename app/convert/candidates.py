"""The list of candidates in an answer, and the counts by status."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.app.schemas.request import WhichCandidates
from joulepath.optimizer.result.candidates import CandidateReport


def chosen(candidates: Sequence[CandidateReport], which: WhichCandidates) -> list[CandidateReport]:
    """The listed candidates of an answer, in order."""
    if which == "none":
        return []
    return [each for each in candidates if which == "all" or each.tried]
