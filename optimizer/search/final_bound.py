"""Lower bound of all motions at the end of a search, and the proof that no candidate is better."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.bounds.free_goal_bound import bound_of_free_goals
from joulepath.optimizer.bounds.missed_branches import all_branches_known, bound_of_missed_branches
from joulepath.optimizer.bounds.raised_bounds import raised_bounds
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Reason
from joulepath.optimizer.search.path_ends import bound_beside
from joulepath.optimizer.search.state import SearchState


def final_bound(state: SearchState, objective: float) -> tuple[float, bool]:
    """Lower bound of all motions, after raising the bounds of candidates below an objective.

    Candidates whose bounds are not below the objective are settled as pruned.

    Args:
        state: state of the search.
        objective: objective of the answer [J].

    Returns:
        The bound [J], and whether bounds prove that no unsolved candidate is better.
    """
    prepared, candidates, deadline = state.prepared, state.candidates, state.deadline
    raised = raised_bounds(prepared, candidates, objective, deadline)
    for candidate, bound in zip(candidates, raised, strict=True):
        candidate.lower_bound = bound
    unsolved = [
        each
        for each in candidates
        if each.status in (CandidateStatus.UNVISITED, CandidateStatus.FAILED)
    ]
    for candidate in unsolved:
        if candidate.lower_bound >= objective:
            candidate.settle(CandidateStatus.PRUNED, Reason.BOUND)
    # only samples of self-motions and free orientations are solved: a bound rules out the others
    unknown, beside = bound_of_missed_branches(prepared, candidates, deadline, objective), np.inf
    if state.problem.tool_path is None:
        free = bound_of_free_goals(prepared, candidates, deadline, objective)
        unknown = min(unknown, free)
    else:
        beside = bound_beside(prepared, candidates, deadline, objective)
        if any(each.sampled for each in candidates):
            unknown = min(unknown, beside)
    # an end without the clearance reserve of the search may still have motions
    unsearched = min((each.lower_bound for each in candidates if not each.holdable), default=np.inf)
    is_ruled_out = (
        all(each.status is CandidateStatus.PRUNED for each in unsolved)
        and min(unknown, unsearched) >= objective
    )
    least = min([unknown, beside, *(each.lower_bound for each in candidates if not each.sampled)])
    return least, is_ruled_out and all_branches_known(state.problem)
