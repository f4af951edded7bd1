"""Comparison of the best motion with the baselines, which may lead to better motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import Spline, least_time_scale, retimed
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.result.baseline import Baseline, BaselineName
from joulepath.optimizer.search.attempts import solve_from
from joulepath.optimizer.search.baselines import baselines, guesses, nearest
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.passing_baselines import stopping_baselines
from joulepath.optimizer.search.path_baselines import path_baselines
from joulepath.optimizer.search.state import ENERGY_TOLERANCE, SearchState
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

DURATION_FACTORS = (1.0, 1 + 1e-5)
"""Factors on the duration of a baseline tried in turn.

Where jumps of jerk are close, rounding takes jerk beyond its limit.
"""
NOT_CONFIRMED = "the certificate did not confirm it, or not before the deadline"
"""Reason why a baseline of less energy is not the answer."""


def compare_with_baselines(state: SearchState, best: Candidate) -> list[Baseline]:
    """The baselines of the best motion, after cheaper baselines were used as initial guesses.

    Only feasible baselines among the method's `guess_baselines` are initial guesses, first coarse,
    then fine. A baseline of the method's own kind (`accepted_baselines`) that still needs less
    energy becomes the answer itself. Other parametrisations may stay below the answer.
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
    # an accepted baseline may change the duration, and with it the other baselines
    while (better := _better(state, table, accepted)) and best.energy != known:
        known = best.energy
        accept_baseline(state, candidate, better)
        best = state.best() or best
        table, candidate = _table(state, best)
    # baselines that still need less are not confirmed
    return [replace(each, reason=NOT_CONFIRMED) if each.name in better else each for each in table]


def _better(
    state: SearchState, table: list[Baseline], names: Sequence[BaselineName]
) -> list[BaselineName]:
    """Feasible baselines of given names that need less than the compared motion."""
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
    """The baselines of a solved candidate, without any solve from them."""
    if state.problem.tool_path is not None:
        return path_baselines(state, best)
    if state.problem.passes:
        assert best.energy is not None
        return stopping_baselines(state.prepared, best.spline, best.energy)
    return _table(state, best)[0]


def _table(state: SearchState, best: Candidate) -> tuple[list[Baseline], Candidate]:
    """The baselines from the best candidate's start to the nearest goal, with their candidate."""
    assert best.energy is not None
    prepared, problem = state.prepared, state.problem
    candidates = state.candidates
    # concatenation takes half the time of an array of arrays
    q_start = np.concatenate([each.q_start for each in candidates]).reshape(len(candidates), -1)
    beside = np.flatnonzero((q_start == best.q_start).all(axis=1)).tolist()
    q_goals = np.array([candidates[row].q_goal for row in beside])
    oracle = prepared.torques, prepared.potential, prepared.broken_on_the_way
    table = baselines(problem, best.q_start, q_goals, best.duration, best.energy, *oracle)
    q_nearest = nearest(problem, best.q_start, q_goals)
    row = beside[int((q_goals == q_nearest).all(axis=1).argmax())]
    return table, candidates[row]


def accept_baseline(state: SearchState, candidate: Candidate, better: list[BaselineName]) -> None:
    """Accept cheaper baselines as motions of a candidate if they are certified in time."""
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
            state.allowed(retimed(motions[name], slower * scale)) for slower in DURATION_FACTORS
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
