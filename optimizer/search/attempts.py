"""Attempts on one candidate: solve it from nothing, or from samples of a known motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.sliding import moved_to, with_sliding_ends
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

# goals of other candidates that a path may lead to as long as no motion is known
MOST_OTHER_GOALS = 7


def context_of(
    incumbent: Incumbent,
    candidate: Candidate,
    interval: DurationInterval,
    incumbent_cost: float = np.inf,
) -> SolveContext:
    """Context of a solve of a candidate in one interval of durations.

    Args:
        incumbent: state of the search.
        candidate: the candidate.
        interval: allowed durations.
        incumbent_cost: cost that the motion must come below [J]; infinite for any motion.
    """
    attempt = candidate.attempt
    planned = attempt is not None and attempt.origin is MotionOrigin.FROM_PLANNED_PATH
    return SolveContext(
        incumbent.prepared,
        candidate.q_start,
        candidate.q_goal,
        incumbent.deadline,
        interval,
        incumbent_cost,
        is_from_planned_path=planned,
    )


def solver_of(
    incumbent: Incumbent,
    candidate: Candidate,
    interval: DurationInterval,
    incumbent_cost: float = np.inf,
) -> Method:
    """The problem's method for a candidate; arguments as of `context_of`."""
    return solver_for(context_of(incumbent, candidate, interval, incumbent_cost))


def in_time(incumbent: Incumbent, attempt: Callable[[], SolveResult]) -> SolveResult:
    """The result of an attempt, whose effort is counted; without a motion if it does not end before
    the deadline.
    """
    try:
        with watch(incumbent.deadline):
            return incumbent.add_effort(attempt())
    except DeadlinePassed:
        return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)


def solve(incumbent: Incumbent, candidate: Candidate) -> SolveResult:
    """Solve the candidate in each of its duration intervals; returns the result of least energy.

    If no interval has a motion, a result that the deadline cut off comes before the others.
    """
    results, solved = list[SolveResult](), list[tuple[SolveResult, Candidate]]()
    for interval in duration_intervals(incumbent.prepared, candidate.q_goal):
        if interval.t_max < candidate.shortest:
            continue
        context = partial(_informed_context, incumbent, candidate, interval)
        result, moved = _attempted(incumbent, candidate, context, lambda solver: solver.solve())
        results.append(result)
        if result.spline is not None:
            solved.append((result, moved))
    if len(solved) > 1:
        solved.sort(key=lambda each: incumbent.prepared.cost_of(each[0].spline))
    if solved:
        candidate.move(solved[0][1])
    late = [result for result in results if result.status is SolveStatus.OUT_OF_TIME]
    postponed = [result for result in results if result.status is SolveStatus.POSTPONED]
    incumbent.cut_short |= bool(late) or any(result.cut_short for result, _ in solved)
    return ([result for result, _ in solved] + late + postponed + results)[0]


def _informed_context(
    incumbent: Incumbent, candidate: Candidate, interval: DurationInterval
) -> SolveContext:
    """Context of a solve, with all that the search knows so far."""
    best, ruled_out = incumbent.best(), CandidateStatus.INFEASIBLE
    attempt, known = candidate.attempt, best is not None and best.energy is not None
    context = context_of(incumbent, candidate, interval)
    return replace(
        context,
        incumbent_cost=best.energy if best is not None and best.energy is not None else np.inf,
        other_goals=tuple if known else partial(_other_goals, incumbent, candidate),
        is_sole=sum(each.status is not ruled_out for each in incumbent.candidates) == 1,
        was_postponed=attempt is not None and attempt.status is SolveStatus.POSTPONED,
    )


def _attempted(
    incumbent: Incumbent,
    candidate: Candidate,
    context_now: Callable[[], SolveContext],
    attempt: Callable[[Method], SolveResult],
) -> tuple[SolveResult, Candidate]:
    """The result of an attempt, and the candidate with the ends of its motion.

    Ends on self-motions slide, unless this leads to where the problem does not allow them to be.
    """
    fixed, prepared = context_now(), incumbent.prepared
    context = with_sliding_ends(fixed, candidate)
    sliding = context is not fixed
    result = in_time(incumbent, partial(attempt, solver_for(context)))
    # the turn of the tool along a path is chosen, and with it where the path begins and ends
    free = candidate.start.tolerance is not None or candidate.goal.tolerance is not None
    turned = incumbent.problem.tool_path is not None and free
    if result.spline is None or not (sliding or turned):
        return result, candidate
    moved = moved_to(prepared, incumbent.candidates, candidate, result.spline)
    if moved is not None:
        return (result if turned else replace(result, ends_slid=True)), moved
    if turned:
        failed, reason = SolveStatus.FAILED, SolveReason.TURN_OUT_OF_REACH
        return replace(result, status=failed, reason=reason, spline=None), candidate
    return in_time(incumbent, partial(attempt, solver_for(context_now()))), candidate


def _other_goals(incumbent: Incumbent, candidate: Candidate) -> list[Array]:
    """Goals (nq,) [rad] of open candidates from the same start, of each branch the nearest,
    MOST_OTHER_GOALS of all.
    """
    nearest: dict[int, Candidate] = {}
    for other in sorted(incumbent.candidates, key=lambda each: (each.shortest, each.lower_bound)):
        is_open = (
            other.status is CandidateStatus.UNVISITED and other.holdable and not other.deferred
        )
        if (
            is_open
            and other.goal is not candidate.goal
            and (other.q_start == candidate.q_start).all()
        ):
            nearest.setdefault(id(other.goal), other)
    return [other.q_goal for other in list(nearest.values())[:MOST_OTHER_GOALS]]


def settled(
    incumbent: Incumbent, candidate: Candidate, result: SolveResult, message: str
) -> Candidate | None:
    """A new candidate with the motion of a result as its own; None if there is no motion."""
    if result.spline is None:
        return None
    candidate.attempt = result
    candidate.settle(CandidateStatus.SOLVED, Reason.METHOD, message)
    candidate.energy = incumbent.prepared.cost_of(result.spline)
    candidate.refined = not incumbent.method.may_refine(result.spline)
    return candidate


def solve_from(
    incumbent: Incumbent,
    candidate: Candidate,
    samples: tuple[Array, Array],
    fine: bool,
    surplus_value: float | None = None,
    duration: float | None = None,
) -> None:
    """Optimise the candidate from samples of a motion, q (k, nq) [rad] at t (k,) [s]; accept what
    needs less energy.

    `fine` asks for more control points. `surplus_value` [1] is the assumed value of a joule of net
    surplus on a bus with energy storage. `duration` [s] fixes the duration.
    """
    q, t = samples
    improve(
        incumbent, candidate, lambda solver: solver.solve_from(q, t, fine), surplus_value, duration
    )


def improve(
    incumbent: Incumbent,
    candidate: Candidate,
    attempt: Callable[[Method], SolveResult],
    surplus_value: float | None = None,
    duration: float | None = None,
) -> None:
    """Optimise the candidate by an attempt in each of its duration intervals; accept what needs
    less energy.

    `surplus_value` and `duration` as of `solve_from`.
    """
    for interval in duration_intervals(incumbent.prepared, candidate.q_goal, surplus_value):
        if duration is not None:
            interval = replace(interval, t_min=duration, t_max=duration)
        context = partial(context_of, incumbent, candidate, interval)
        result, moved = _attempted(incumbent, candidate, context, attempt)
        if result.spline is not None:
            incumbent.accept_if_better(
                candidate, result, incumbent.prepared.energy(result.spline), moved
            )
