"""Attempts on one candidate: solve it from nothing, or from samples of a known motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.sliding import moved_to, with_sliding_ends
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
)

MOST_OTHER_GOALS = 7
"""Goals of other candidates to which a path may lead while no motion is known."""


def context_of(
    state: SearchState,
    candidate: Candidate,
    interval: DurationInterval,
    incumbent_cost: float = np.inf,
) -> SolveContext:
    """Context of a solve of a candidate in one interval of durations.

    Args:
        state: state of the search.
        candidate: the candidate.
        interval: allowed durations.
        incumbent_cost: cost that the motion must come below [J]; infinite for any motion.
    """
    attempt = candidate.attempt
    planned = attempt is not None and attempt.origin is MotionOrigin.FROM_PLANNED_PATH
    return SolveContext(
        state.prepared,
        candidate.q_start,
        candidate.q_goal,
        state.deadline,
        interval,
        incumbent_cost,
        is_from_planned_path=planned,
    )


def solver_of(
    state: SearchState,
    candidate: Candidate,
    interval: DurationInterval,
    incumbent_cost: float = np.inf,
) -> Method:
    """The problem's method for a candidate; arguments as of `context_of`."""
    return solver_for(context_of(state, candidate, interval, incumbent_cost))


def in_time(state: SearchState, attempt: Callable[[], SolveResult]) -> SolveResult:
    """The result of an attempt, whose effort is counted; no motion if the deadline passes."""
    try:
        with watch(state.deadline):
            return state.add_effort(attempt())
    except DeadlinePassed:
        return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)


def solve(state: SearchState, candidate: Candidate) -> SolveResult:
    """Solve a candidate in each of its duration intervals.

    Returns:
        The result of least energy. If no interval has a motion, a result that the deadline cut off
        comes before the others.
    """
    results, solved = list[SolveResult](), list[tuple[SolveResult, Candidate]]()
    for interval in duration_intervals(state.prepared, candidate.q_goal):
        if interval.t_max < candidate.shortest:
            continue
        context = partial(_informed_context, state, candidate, interval)
        result, moved = attempted(state, candidate, context, lambda solver: solver.solve())
        results.append(result)
        if result.spline is not None:
            solved.append((result, moved))
    if len(solved) > 1:
        solved.sort(key=lambda each: state.prepared.cost_of(each[0].spline))
    if solved:
        candidate.move(solved[0][1])
    late = [result for result in results if result.status is SolveStatus.OUT_OF_TIME]
    postponed = [result for result in results if result.status is SolveStatus.POSTPONED]
    state.cut_short |= bool(late) or any(result.cut_short for result, _ in solved)
    return ([result for result, _ in solved] + late + postponed + results)[0]


def _informed_context(
    state: SearchState, candidate: Candidate, interval: DurationInterval
) -> SolveContext:
    """Context of a solve, with all that the search knows so far."""
    best, ruled_out = state.best(), CandidateStatus.INFEASIBLE
    attempt, known = candidate.attempt, best is not None and best.energy is not None
    context = context_of(state, candidate, interval)
    return replace(
        context,
        incumbent_cost=best.energy if best is not None and best.energy is not None else np.inf,
        other_goals=tuple if known else partial(_other_goals, state, candidate),
        is_sole=sum(each.status is not ruled_out for each in state.candidates) == 1,
        was_postponed=attempt is not None and attempt.status is SolveStatus.POSTPONED,
    )


def attempted(
    state: SearchState,
    candidate: Candidate,
    context_now: Callable[[], SolveContext],
    attempt: Callable[[Method], SolveResult],
) -> tuple[SolveResult, Candidate]:
    """The result of an attempt, and the candidate with the ends of its motion.

    Ends on self-motions slide. If they slide to where the problem forbids them to be, the attempt
    is repeated with fixed ends.

    Args:
        state: state of the search.
        candidate: the candidate.
        context_now: makes the context of a solve.
        attempt: the attempt.
    """
    fixed, prepared = context_now(), state.prepared
    context = with_sliding_ends(fixed, candidate)
    sliding = context is not fixed
    result = in_time(state, partial(attempt, solver_for(context)))
    # the solver chooses the turn of the tool along a path, and with it the ends of the path
    free = candidate.start.tolerance is not None or candidate.goal.tolerance is not None
    turned = state.problem.tool_path is not None and free
    if result.spline is None or not (sliding or turned):
        return result, candidate
    moved = moved_to(prepared, state.candidates, candidate, result.spline)
    if moved is not None:
        return (result if turned else replace(result, ends_slid=True)), moved
    if turned:
        failed, reason = SolveStatus.FAILED, SolveReason.TURN_OUT_OF_REACH
        return replace(result, status=failed, reason=reason, spline=None), candidate
    return in_time(state, partial(attempt, solver_for(context_now()))), candidate


def _other_goals(state: SearchState, candidate: Candidate) -> list[Array]:
    """Goals (nq,) [rad] of open candidates from the same start, the nearest of each branch."""
    nearest: dict[EndConfiguration, Candidate] = {}
    for other in sorted(state.candidates, key=lambda each: (each.shortest, each.lower_bound)):
        is_open = (
            other.status is CandidateStatus.UNVISITED and other.holdable and not other.deferred
        )
        if (
            is_open
            and other.goal is not candidate.goal
            and (other.q_start == candidate.q_start).all()
        ):
            nearest.setdefault(other.goal, other)
    return [other.q_goal for other in list(nearest.values())[:MOST_OTHER_GOALS]]


def settled(
    state: SearchState, candidate: Candidate, result: SolveResult, message: str
) -> Candidate | None:
    """A new candidate with the motion of a result as its own; None if there is no motion."""
    if result.spline is None:
        return None
    candidate.attempt = result
    candidate.settle(CandidateStatus.SOLVED, Reason.METHOD, message)
    candidate.energy = state.prepared.cost_of(result.spline)
    candidate.refined = not state.method.may_refine(result.spline)
    return candidate


def solve_from(
    state: SearchState,
    candidate: Candidate,
    samples: tuple[Array, Array],
    fine: bool,
    surplus_value: float | None = None,
) -> None:
    """Optimise a candidate from samples of a motion, and accept a motion of less energy.

    Args:
        state: state of the search.
        candidate: the candidate.
        samples: q, shape (k, nq) [rad], and t, shape (k,) [s].
        fine: whether to use more control points.
        surplus_value: assumed value of a joule of net surplus on a bus with energy storage [1].
    """
    q, t = samples
    improve(state, candidate, lambda solver: solver.solve_from(q, t, fine), surplus_value)


def improve(
    state: SearchState,
    candidate: Candidate,
    attempt: Callable[[Method], SolveResult],
    surplus_value: float | None = None,
) -> None:
    """Optimise a candidate by an attempt in each duration interval, and accept a motion of less
    energy.

    Args:
        state: state of the search.
        candidate: the candidate.
        attempt: the attempt.
        surplus_value: as in `solve_from`.
    """
    for interval in duration_intervals(state.prepared, candidate.q_goal, surplus_value):
        context = partial(context_of, state, candidate, interval)
        result, moved = attempted(state, candidate, context, attempt)
        if result.spline is not None:
            state.accept_if_better(candidate, result, state.prepared.energy(result.spline), moved)
