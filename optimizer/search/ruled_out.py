"""What a search has proven at its end: a bound for every motion, and whether all other candidates
are ruled out.
"""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Reason
from joulepath.optimizer.search.free_goal_bound import family_bound_of
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.missed_branches import all_known, bound_of_others
from joulepath.optimizer.search.path_ends import bound_beside
from joulepath.optimizer.search.raised_bounds import raise_bounds


def ruled_out(incumbent: Incumbent, objective: float) -> tuple[float, bool]:
    """What no motion goes below [J], and whether every candidate that was not solved needs at least
    `objective`.
    """
    prepared, candidates = incumbent.prepared, incumbent.candidates
    raise_bounds(prepared, candidates, objective, incumbent.deadline)
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
    family, beside = bound_of_others(prepared, candidates, incumbent.deadline, objective), np.inf
    if incumbent.problem.tool_path is None:
        family = min(family, family_bound_of(prepared, candidates, incumbent.deadline, objective))
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
    return least, done and all_known(incumbent.problem)
