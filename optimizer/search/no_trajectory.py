"""The error of a search without a motion."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.errors import NoCollisionFreeTrajectory
from joulepath.optimizer.search.state import SearchState


def no_motion(state: SearchState) -> NoTrajectory | DeadlineExceeded:
    """The error of a search without a result: the deadline, if it ended the search.

    A collision is reported even after the deadline, because its pair of bodies shows the remedy.
    """
    is_open = any(each.status is CandidateStatus.UNVISITED for each in state.candidates)
    collides = any(each.attempt and each.attempt.collision for each in state.candidates)
    if is_open or (state.deadline.passed and not collides):
        return state.too_late()
    return no_trajectory(state.candidates)


def no_trajectory(candidates: Sequence[Candidate]) -> NoTrajectory:
    """The error for no motion, with the shallowest collision of all candidates, if any."""
    reports = [candidate.report() for candidate in candidates]
    hits = [
        (each, each.attempt.collision)
        for each in candidates
        if each.attempt and each.attempt.collision
    ]
    if not hits:
        return NoTrajectory(reports)
    candidate, hit = max(hits, key=lambda each: each[1].min_clearance)
    cut_short = any(each.attempt is not None and each.attempt.cut_short for each in candidates)
    return NoCollisionFreeTrajectory(
        reports,
        pair=hit.pair,
        depth=max(-hit.min_clearance, 0.0),
        time=hit.time,
        start=candidate.start.label,
        goal=candidate.goal.label,
        cut_short=cut_short,
    )
