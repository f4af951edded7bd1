"""Why a search has no motion."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.optimizer.exceptions import NoCollisionFreeTrajectory, NoTrajectory
from joulepath.optimizer.search.candidates import Candidate


def no_trajectory(candidates: Sequence[Candidate]) -> NoTrajectory:
    """The error for no motion at all; it names the collision that stopped the best candidate, if there is one."""
    reports = [candidate.report() for candidate in candidates]
    hits = [(each, each.attempt.collision) for each in candidates if each.attempt and each.attempt.collision]
    if not hits:
        return NoTrajectory(reports)
    candidate, hit = max(hits, key=lambda each: each[1].min_clearance)
    cut_short = any(each.attempt is not None and each.attempt.cut_short for each in candidates)
    return NoCollisionFreeTrajectory(reports, hit, candidate.start.label, candidate.goal.label, cut_short)
