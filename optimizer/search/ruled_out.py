"""What a search has proven at its end: a bound for every motion, and whether all other candidates
are ruled out.
"""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.bounds.free_goal_bound import bound_of_free_goals
from joulepath.optimizer.bounds.missed_branches import all_branches_known, bound_of_missed_branches
from joulepath.optimizer.bounds.raised_bounds import raised_bounds
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Reason
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.path_ends import bound_beside


def ruled_out(incumbent: Incumbent, objective: float) -> tuple[float, bool]:
    """What no motion goes below [J], and whether every candidate that was not solved needs at least
    `objective`.
    """
    prepared, candidates = incumbent.prepared, incumbent.candidates
    raised = raised_bounds(prepared, candidates, objective, incumbent.deadline)
    for candidate, value in zip(candidates, raised, strict=True):
        candidate.lower_bound = value
    open_ = [
        each
        for each in candidates
        if each.status in (CandidateStatus.UNVISITED, CandidateStatus.FAILED)
    ]
    for candidate in open_:
        if candidate.lower_bound >= objective:
            candidate.settle(CandidateStatus.PRUNED, Reason.BOUND)
    # of a target that infinitely many configurations reach, only samples are solved: it is done
    # only if a bound rules all of it out
    family, beside = (
        bound_of_missed_branches(prepared, candidates, incumbent.deadline, objective),
        np.inf,
    )
    if incumbent.problem.tool_path is None:
        family = min(
            family, bound_of_free_goals(prepared, candidates, incumbent.deadline, objective)
        )
    else:
        beside = bound_beside(prepared, candidates, incumbent.deadline, objective)
        family = min(family, beside) if any(each.sampled for each in candidates) else family
    # an end that is infeasible for the search may still be one of other motions
    unsought = min((each.lower_bound for each in candidates if not each.holdable), default=np.inf)
    done = (
        all(each.status is CandidateStatus.PRUNED for each in open_)
        and min(family, unsought) >= objective
    )
    least = min([family, beside, *(each.lower_bound for each in candidates if not each.sampled)])
    return least, done and all_branches_known(incumbent.problem)
