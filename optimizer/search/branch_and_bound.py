"""Best-first search over candidates: solve in order of lower bound until no bound is below the
incumbent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.solve_result import SolveResult, SolveStatus


def explore(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    attempt: Callable[[Candidate], SolveResult],
    deadline: Deadline,
    most_solved: int | None = None,
    ended: Callable[[Candidate], None] = lambda _: None,
) -> Candidate | None:
    """Solve candidates in order of lower bound until none is below the incumbent; returns it, None
    if there is none.

    After `most_solved` solved candidates the others are not solved. A candidate that is postponed
    comes again after those to which a path is known, and, if none is known to itself, after those
    whose goals do not seem enclosed. `ended` gets every candidate that was solved, or tried in
    vain.
    """
    best = min(
        (e for e in candidates if e.energy is not None), key=lambda e: e.energy or 0.0, default=None
    )
    queue = sorted(candidates, key=lambda e: (e.lower_bound, e.shortest))
    while queue:
        candidate = queue.pop(0)
        if candidate.status is not CandidateStatus.UNVISITED or candidate.deferred:
            continue
        if best is not None and best.energy is not None and candidate.lower_bound >= best.energy:
            candidate.settle(CandidateStatus.PRUNED, Reason.BOUND)
            continue
        if (
            most_solved is not None
            and sum(e.status is CandidateStatus.SOLVED for e in candidates) >= most_solved
        ):
            message = f"the method solves no more than {most_solved} candidates"
            candidate.settle(CandidateStatus.UNVISITED, Reason.ENOUGH_SOLVED, message)
            continue
        if deadline.passed:
            break
        candidate.attempt = result = attempt(candidate)
        if result.status is SolveStatus.OUT_OF_TIME:
            break
        if result.status is SolveStatus.POSTPONED:
            queue.insert(0, candidate)
            queue.sort(key=lambda e: _hopelessness(prepared, e))
            continue
        candidate.settle(CandidateStatus(result.status.value), Reason.METHOD, result.message)
        if result.spline is not None:
            candidate.energy = prepared.cost_of(result.spline)
            candidate.refined = not method_of(prepared.problem).may_refine(result.spline)
            if best is None or best.energy is None or candidate.energy < best.energy:
                best = candidate
        ended(candidate)
    return best


def _hopelessness(prepared: PreparedProblem, candidate: Candidate) -> int:
    """0 if a path to a candidate's goal is known, 2 if this goal seems enclosed, else 1."""
    ends = candidate.q_start, candidate.q_goal
    if prepared.surroundings.has_planned_paths(*ends):
        return 0
    return 2 if prepared.surroundings.seems_enclosed(*ends) else 1
