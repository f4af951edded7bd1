"""Best-first search over candidates: solve in order of lower bound until no bound is below the incumbent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import cast

from optimizer.deadline import Deadline
from optimizer.methods.method import SolveResult, SolveStatus
from optimizer.prepared_problem import PreparedProblem
from optimizer.search.candidates import Candidate
from optimizer.solution import CandidateStatus

PRUNED = "its lower bound is not below the best energy found"


def explore(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    attempt: Callable[[Candidate], SolveResult],
    deadline: Deadline,
    most_solved: int | None = None,
) -> Candidate | None:
    """Solve candidates in order of bound until no bound is below the best found; returns the best, None if none.

    With `most_solved`, candidates beyond so many solved ones are left unless a bound rules them out.
    """
    best = min((e for e in candidates if e.energy is not None), key=lambda e: e.energy or 0.0, default=None)
    for candidate in sorted(candidates, key=lambda e: (e.lower_bound, e.shortest)):
        if candidate.status != "unvisited" or candidate.deferred:
            continue
        if best is not None and best.energy is not None and candidate.lower_bound >= best.energy:
            candidate.status, candidate.reason = "pruned", PRUNED
            continue
        if most_solved is not None and sum(e.status == "solved" for e in candidates) >= most_solved:
            candidate.reason = f"the method solves no more than {most_solved} candidates"
            continue
        if deadline.passed:
            break
        candidate.attempt = outcome = attempt(candidate)
        if outcome.status is SolveStatus.OUT_OF_TIME:
            break
        candidate.status, candidate.reason = cast(CandidateStatus, outcome.status.value), outcome.reason
        if outcome.spline is not None:
            candidate.energy = prepared.objective_of(prepared.energy(outcome.spline))
            if best is None or best.energy is None or candidate.energy < best.energy:
                best = candidate
    return best
