"""Refinement of the best motion: finer motions, other values of the surplus, and the baselines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import Spline, least_time_scale, retimed, sampled
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.result.solution import Baseline, BaselineName
from joulepath.optimizer.search.attempts import improve, solve_from
from joulepath.optimizer.search.baselines import baselines, guesses, nearest
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.passing import stopping_baselines
from joulepath.optimizer.search.path_baselines import path_baselines
from joulepath.optimizer.search.sharpening import sharpen
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import DURATION_TOLERANCE, ENERGY_TOLERANCE, SearchState
from joulepath.optimizer.search.switch_knots import follow_switches
from joulepath.optimizer.solve.methods.free_spline import FREE_SPLINE
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES


@dataclass(frozen=True)
class RefinementSettings:
    """Settings of the refinement of a motion."""

    surplus_shares: tuple[float, ...] = (0.75, 0.5, 0.25)
    """Assumed values of a joule of surplus if the storage cannot take all of it.

    They are shares of the way from the price that the supply pays to the share that the storage
    gives back.
    """
    duration_factors: tuple[float, ...] = (1.0, 1 + 1e-5)
    """Factors on the duration of a baseline that are tried in turn.

    Where jumps of jerk are close, rounding takes jerk beyond its limit.
    """


REFINEMENT = RefinementSettings()
NOT_CONFIRMED = "the certificate did not confirm it, or not before the deadline"
"""Reason why a baseline of less energy is not the answer."""


def refine(state: SearchState, candidate: Candidate) -> None:
    """Improve the motion of a solved candidate as far as the method and the deadline allow."""
    method, problem, deadline = state.method, state.problem, state.deadline
    candidate.refined = True
    sharpen(state, candidate)
    if method.may_refine(candidate.spline) and not deadline.passed:
        coarse = candidate.spline
        exact = lasts_below(FREE_SPLINE.exact_below, state, candidate)
        tight = lasts_below(SPLINE_SPACES.tight, state, candidate)
        if tight and slides(state.prepared, candidate):
            follow_switches(state, candidate)
        else:
            improve(state, candidate, lambda solver: solver.refined(coarse, fine=exact))
        if exact and candidate.spline is coarse and not state.deadline.passed:
            improve(state, candidate, lambda solver: solver.refined(coarse, fine=False))
    if method.may_grade(candidate.spline) and not deadline.passed:
        solve_from(state, candidate, sampled(candidate.spline), fine=True)
    if not method.guess_baselines:
        return
    if state.uses_storage:
        supply = problem.arm.regeneration
        for share in REFINEMENT.surplus_shares:
            if not deadline.passed:
                value = supply + share * max(problem.arm.bus.efficiency - supply, 0.0)
                solve_from(
                    state, candidate, sampled(candidate.spline), fine=False, surplus_value=value
                )
    longest, spline = problem.duration_max or 0.0, candidate.spline
    is_faster = spline.duration < longest * (1 - DURATION_TOLERANCE)
    if problem.objective == "mechanical" and is_faster and not deadline.passed:
        # the smoothed |tau v| is positive at rest, the work is not: a free duration is too short.
        # `lasting` rounds otherwise, which leads the objective to other local optima
        slower = retimed(spline, longest / spline.duration)
        solve_from(state, candidate, sampled(slower), fine=False, duration=longest)


@dataclass(frozen=True)
class RivalSettings:
    """Settings of the choice of other candidates that are refined.

    A candidate is refined if a multiple of the gain by refining the best candidate would bring its
    energy below the best.
    """

    gain: float = 1.25
    """Multiple with a free duration.

    Under a limit on the TCP's speed, refinement gained 2 % for one candidate and 3 % for the next.
    """
    gain_in_time: float = 3.0
    """Multiple with a fixed duration: 2 % for one candidate and 6 % for the next."""


RIVALS = RivalSettings()


def refine_rivals(
    state: SearchState, best: Candidate, coarse: float, settings: RivalSettings = RIVALS
) -> None:
    """Refine other candidates that may come below the best one.

    Samples of one pose are left out, because the refined best candidate is their optimum too. Where
    powers have corners, `sharpen` has followed other candidates already.

    Args:
        state: state of the search.
        best: the best candidate, refined.
        coarse: its energy before it was refined [J].
        settings: settings of the choice.
    """
    problem = state.problem
    if has_corners(problem.objective, problem.arm) or best.energy is None:
        return
    in_time = problem.duration_max is not None and problem.duration_min == problem.duration_max
    most = best.energy + (settings.gain_in_time if in_time else settings.gain) * (
        coarse - best.energy
    )
    for rival in state.candidates:
        is_open = (
            rival.energy is not None
            and rival.energy < most
            and not rival.refined
            and not rival.refused
        )
        if (
            is_open
            and not (rival.start.sampled or rival.goal.sampled)
            and not state.deadline.passed
        ):
            refine(state, rival)


def lasts_below(ratio: float, state: SearchState, candidate: Candidate) -> bool:
    """Whether a motion takes less than a multiple of the shortest duration of its joints.

    Then its jerk switches nearly as in the fastest motion.
    """
    displacement = candidate.q_goal - candidate.q_start
    return candidate.spline.duration < ratio * float(
        shortest_duration(displacement, state.problem.arm.active_limits)
    )


def compare_with_baselines(state: SearchState, best: Candidate) -> list[Baseline]:
    """The baselines, after a feasible baseline of less energy was used as initial guess, first
    coarse, then fine.

    Only the method's `guess_baselines` are initial guesses. If one still needs less energy and is
    of the method's own kind (`accepted_baselines`), it becomes the answer itself: what another
    parametrisation does better is not.
    """
    if state.problem.tool_path is not None or state.problem.passes:
        return baselines_of(state, best)
    table, candidate = _table(state, best)
    for fine in (False, True):
        better = _better(state, table, state.method.guess_baselines)
        if not better or candidate.refused:
            break
        motions = guesses(state.problem, best.q_start, candidate.q_goal, best.duration)
        for name in better:
            if not state.deadline.passed:
                solve_from(state, candidate, (motions[name].q, motions[name].t), fine)
        best = state.best() or best
        table, candidate = _table(state, best)
    accepted = state.method.accepted_baselines
    known: float | None = np.inf
    # one of another duration moves those that are compared in ours
    while (better := _better(state, table, accepted)) and best.energy != known:
        known = best.energy
        accept_baseline(state, candidate, better)
        best = state.best() or best
        table, candidate = _table(state, best)
    # what needs less all the same is not confirmed, and no motion in hand
    return [replace(each, reason=NOT_CONFIRMED) if each.name in better else each for each in table]


def _better(
    state: SearchState, table: list[Baseline], names: Sequence[BaselineName]
) -> list[BaselineName]:
    """Those of the named baselines that are feasible and need less than the motion they are
    compared with.
    """
    return [
        each.name
        for each in table
        if each.name in names
        and each.within_limits
        and each.saving is not None
        and each.saving < -ENERGY_TOLERANCE
        and state.allows(each.duration)
    ]


def baselines_of(state: SearchState, best: Candidate) -> list[Baseline]:
    """The baselines of a solved candidate as they are, whether they need less or not."""
    if state.problem.tool_path is not None:
        return path_baselines(state, best)
    if state.problem.passes:
        assert best.energy is not None
        return stopping_baselines(state.prepared, best.spline, best.energy)
    return _table(state, best)[0]


def _table(state: SearchState, best: Candidate) -> tuple[list[Baseline], Candidate]:
    """The baselines from the start of the best candidate to the nearest goal, and the candidate
    between these.
    """
    assert best.energy is not None
    prepared, problem = state.prepared, state.problem
    candidates = state.candidates
    beside = (np.array([each.q_start for each in candidates]) == best.q_start).all(axis=1)
    q_goals = np.array([each.q_goal for each in candidates])[beside]
    oracle = prepared.torques, prepared.potential, prepared.broken_on_the_way
    table = baselines(problem, best.q_start, q_goals, best.duration, best.energy, *oracle)
    q_nearest = nearest(problem, best.q_start, q_goals)
    at = (
        each
        for each in candidates
        if (each.q_start == best.q_start).all() and (each.q_goal == q_nearest).all()
    )
    return table, next(at)


def accept_baseline(state: SearchState, candidate: Candidate, better: list[BaselineName]) -> None:
    """Accept the baselines `better` as motions of the candidate, each as an exact spline, if they
    are certified.

    Those that are not certified before the deadline do not count.
    """
    try:
        with watch(state.deadline):
            _accept_certified(state, candidate, better)
    except DeadlinePassed:
        return


def _accept_certified(state: SearchState, candidate: Candidate, better: list[BaselineName]) -> None:
    best = state.best()
    assert best is not None
    limits, duration = state.problem.arm.active_limits, best.duration
    fastest = time_optimal_spline(limits, candidate.q_start, candidate.q_goal)
    motions: dict[BaselineName, Spline] = {
        "ruckig": fastest,
        "ruckig_slowed": retimed(fastest, duration / fastest.duration),
        "quintic": quintic_spline(candidate.q_start, candidate.q_goal, duration),
    }
    for name in better:
        scale = max(least_time_scale(motions[name], limits.rates), 1.0)
        for spline in (
            state.allowed(retimed(motions[name], slower * scale))
            for slower in REFINEMENT.duration_factors
        ):
            if spline is None:
                continue
            energy = state.prepared.energy(spline)
            if state.certified(candidate, spline, energy).valid:
                state.accept_if_better(
                    candidate,
                    SolveResult(
                        SolveStatus.SOLVED, SolveReason.BASELINE, spline=spline, figures=(name,)
                    ),
                    energy,
                    certified=True,
                )
                break
