"""Comparison of the best motion with the baselines; a cheaper baseline improves the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.motion import bspline, quintic, ramped
from joulepath.optimizer.motion.passing import pass_times
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import Spline, least_time_scale, retimed
from joulepath.optimizer.motion.time_scalings import SampledMotion, quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.result.baseline import Baseline, BaselineName
from joulepath.optimizer.search.attempts import solve_from
from joulepath.optimizer.search.baselines import baselines, compared, guesses, nearest, standing
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import ENERGY_TOLERANCE, SearchState
from joulepath.optimizer.search.waypoint_baselines import samples_of, slowed
from joulepath.optimizer.solve.methods.duration_intervals import fastest
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath
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
    then fine. If a baseline of the method's own kind (`accepted_baselines`) still needs less
    energy, it becomes the answer. Baselines of other parametrisations may need less energy than
    the answer.
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
    # a baseline of less energy is not confirmed by its certificate
    return [replace(each, reason=NOT_CONFIRMED) if each.name in better else each for each in table]


def _better(
    state: SearchState, table: list[Baseline], names: Sequence[BaselineName]
) -> list[BaselineName]:
    """Feasible baselines of given names with less energy than the compared motion."""
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


def stopping_baselines(prepared: PreparedProblem, spline: Spline, ours: float) -> list[Baseline]:
    """Baselines with a rest at every pass, and with the times of our motion between the passes.

    A baseline is left out if one of its parts is missing.

    Args:
        prepared: the problem.
        spline: our motion.
        ours: its objective [J].
    """
    problem: Problem = replace(prepared.problem, passes=(), dwell=None)
    q = np.array([spline.control_points[0], *prepared.problem.passes, spline.control_points[-1]])
    times = [0.0, *pass_times(spline.curve, q[1:-1]).tolist(), spline.duration]
    oracle = prepared.torques, prepared.potential, prepared.broken_on_the_way
    parts = [
        {
            each.name: each
            for each in baselines(
                problem, a, b[None], max(end - begin, DURATIONS.least), ours, *oracle
            )
        }
        for (a, b), (begin, end) in zip(pairwise(q), pairwise(times), strict=True)
    ]
    tables = [
        [part[name] for part in parts] for name in parts[0] if all(name in part for part in parts)
    ]
    return [_joined(problem, table, ours) for table in tables]


def _joined(problem: Problem, parts: list[Baseline], ours: float) -> Baseline:
    """One baseline from the baselines of the parts."""
    electrical, mechanical = (
        sum(each.electrical for each in parts),
        sum(each.mechanical for each in parts),
    )
    known = [each.sensitivity for each in parts if each.sensitivity is not None]
    return replace(
        parts[-1],
        duration=sum(each.duration for each in parts),
        electrical=electrical,
        mechanical=mechanical,
        saving=saving(ours, electrical if problem.objective == "electrical" else mechanical),
        reason="; ".join(dict.fromkeys(each.reason for each in parts if each.reason)) or None,
        sensitivity=reduce(add, known) if len(known) == len(parts) else None,
    )


@dataclass(frozen=True)
class PathBaselineSettings:
    """Settings of the baselines along a tool path."""

    ramps: tuple[float, ...] = (0.2, 1 / 3, 0.5)
    """Shares of the time that a ramp of an even speed may take, from the shortest: the fastest
    motion counts. Jerk asks for long ramps, and bends of the path for short ones."""

    points_per_point: int = 3
    """Control points of a motion per control point of its path: the tool leaves the path by less
    than its tolerance."""

    instants: int = 1000
    """Instants at which a law of time is sampled."""


PATH_BASELINES = PathBaselineSettings()


def path_baselines(state: SearchState, best: Candidate) -> list[Baseline]:
    """Compute the baselines along the joint path of the best candidate.

    - `even_speed`: an even speed between two smooth ramps, like the linear motion of a controller
    - `quintic`: the rest-to-rest polynomial of degree 5

    Both are as fast as speed, acceleration and jerk of the joints and the speeds of TCP and elbow
    allow, but not faster than our motion.

    Args:
        state: state of the search.
        best: the solved candidate of least energy.

    Returns:
        The baselines with an admissible duration.
    """
    prepared, problem, settings = state.prepared, state.problem, PATH_BASELINES
    path = prepared.followed.joint_path(best.q_start)
    assert path is not None and best.energy is not None
    space = bspline.uniform(settings.points_per_point * len(path.control_points))
    along, t = (
        RetimedPath(prepared, path, fastest(prepared), space),
        np.linspace(0.0, 1.0, settings.instants),
    )

    def motion(s: Array) -> SampledMotion:
        unit = along.motion(along.variables(s, t))
        fast = retimed(unit, least_time_scale(unit, problem.arm.active_limits.rates))
        return slowed(prepared, samples_of(fast), best.duration)

    even = [motion(ramped.fraction(t, ramp)) for ramp in settings.ramps]
    motions: dict[BaselineName, SampledMotion] = {
        # rounding makes durations equal, and `min` then takes the first, with the shortest ramps
        "even_speed": min(even, key=lambda each: round(each.duration, 9)),
        "quintic": motion(quintic.fraction(t)),
    }
    held, found = standing(problem.arm, best.q_goal, prepared.torques), list[Baseline]()
    for name, each in motions.items():
        if state.allows(each.duration):
            tau = prepared.torques(each.q, each.v, each.a)
            (broken,) = prepared.broken_on_the_way([each.q], [each.v], [each.q])
            ours, oracle = best.energy, (prepared.potential, broken)
            found.append(compared(problem, name, each, tau, held, ours, *oracle))
    return found
