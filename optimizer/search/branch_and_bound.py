"""Best-first search over candidates in order of their lower bounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import attrgetter

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
    """Solve candidates in order of lower bound until no bound is below the best energy.

    Postponed candidates are requeued by the outlook of their path: planned, unknown, goal enclosed.

    Args:
        prepared: problem of the motions.
        candidates: candidates.
        attempt: solves a candidate.
        deadline: instant at which the search ends.
        most_solved: number of solved candidates after which no other is solved.
        ended: receives every candidate after its attempt.

    Returns:
        The best candidate; None if no candidate has a motion.
    """
    best = min(
        (each for each in candidates if each.energy is not None),
        key=lambda each: each.energy or 0.0,
        default=None,
    )
    queue = sorted(candidates, key=attrgetter("lower_bound", "shortest"))
    while queue:
        candidate = queue.pop(0)
        if candidate.status is not CandidateStatus.UNVISITED or candidate.deferred:
            continue
        if best is not None and best.energy is not None and candidate.lower_bound >= best.energy:
            candidate.settle(CandidateStatus.PRUNED, Reason.BOUND)
            continue
        if (
            most_solved is not None
            and sum(each.status is CandidateStatus.SOLVED for each in candidates) >= most_solved
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
            queue.sort(key=lambda each: _path_outlook(prepared, each))
            continue
        candidate.settle(CandidateStatus(result.status.value), Reason.METHOD, result.message)
        if result.spline is not None:
            candidate.energy = prepared.cost_of(result.spline)
            candidate.refined = not method_of(prepared.problem).may_refine(result.spline)
            if best is None or best.energy is None or candidate.energy < best.energy:
                best = candidate
        ended(candidate)
    return best


def _path_outlook(prepared: PreparedProblem, candidate: Candidate) -> int:
    """0 if a path to a candidate's goal is planned, 2 if the goal seems enclosed, else 1."""
    ends = candidate.q_start, candidate.q_goal
    if prepared.surroundings.has_planned_paths(*ends):
        return 0
    return 2 if prepared.surroundings.seems_enclosed(*ends) else 1
