"""Refinement of the incumbent: finer motions, other values of the surplus, and the comparison with
the baselines.
"""

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
from joulepath.optimizer.search.incumbent import SLACK, Incumbent
from joulepath.optimizer.search.passing import stopping_baselines
from joulepath.optimizer.search.path_baselines import path_baselines
from joulepath.optimizer.search.regrading import grade
from joulepath.optimizer.search.sharpening import sharpen
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.solve.methods.free_spline import FREE_SPLINE
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES

# assumed values of a joule of surplus if the storage cannot take all of it: shares of the way from
# what the supply pays for it to what the storage gives back
SURPLUS_VALUES = (0.75, 0.5, 0.25)
# factors tried for the duration of a baseline: where jumps of jerk are close, rounding takes jerk
# beyond its limit
SLOWER = (1.0, 1 + 1e-5)
# why a baseline of less energy is not the answer
NOT_CONFIRMED = "the certificate did not confirm it, or not before the deadline"


def refine(incumbent: Incumbent, candidate: Candidate) -> None:
    """Improve the motion of a solved candidate, as far as the method and the deadline allow."""
    method, problem, deadline = incumbent.method, incumbent.problem, incumbent.deadline
    candidate.refined = True
    sharpen(incumbent, candidate)
    if method.may_refine(candidate.spline) and not deadline.passed:
        coarse = candidate.spline
        exact = lasts_below(FREE_SPLINE.exact_below, incumbent, candidate)
        tight = lasts_below(SPLINE_SPACES.tight, incumbent, candidate)
        if tight and slides(incumbent.prepared, candidate):
            grade(incumbent, candidate)
        else:
            improve(incumbent, candidate, lambda solver: solver.refined(coarse, fine=exact))
        if exact and candidate.spline is coarse and not incumbent.deadline.passed:
            improve(incumbent, candidate, lambda solver: solver.refined(coarse, fine=False))
    if method.may_grade(candidate.spline) and not deadline.passed:
        solve_from(incumbent, candidate, sampled(candidate.spline), fine=True)
    if not method.guess_baselines:
        return
    if incumbent.uses_storage:
        supply = problem.arm.regeneration
        for share in SURPLUS_VALUES:
            if not deadline.passed:
                value = supply + share * max(problem.arm.bus.efficiency - supply, 0.0)
                solve_from(
                    incumbent, candidate, sampled(candidate.spline), fine=False, surplus_value=value
                )
    longest, spline = problem.duration_max or 0.0, candidate.spline
    may_be_slower = problem.objective == "mechanical" and spline.duration < longest * (1 - SLACK)
    if may_be_slower and not deadline.passed:
        # the smoothed |tau v| is above zero at rest, the work is not: a free duration ends too soon
        # not `lasting`: its other rounding leads the mechanical objective to other local optima
        slower = retimed(spline, longest / spline.duration)
        solve_from(incumbent, candidate, sampled(slower), fine=False, duration=longest)


@dataclass(frozen=True)
class RivalSettings:
    """Which other candidates are refined, relative to the gain of refining the best one.

    A rival is refined if this multiple of the gain would bring its energy below that of the best
    candidate.
    """

    gain: float = 1.25
    """With a free duration. Under a limit on the TCP's speed, refining gained 2 % of one candidate
    and 3 % of the next."""
    gain_in_time: float = 3.0
    """With a fixed duration: 2 % of one candidate and 6 % of the next."""


def refine_rivals(
    incumbent: Incumbent, best: Candidate, coarse: float, settings: RivalSettings | None = None
) -> None:
    """Refine the other candidates that may come below the best one.

    Samples of one pose are left out, because the refined best candidate is their optimum, too.
    Where powers have corners, `sharpen` has followed the rivals already.

    Args:
        incumbent: state of the search.
        best: the best candidate, refined.
        coarse: its energy before it was refined [J].
        settings: which rivals are refined; None for the defaults.
    """
    settings = settings or RivalSettings()
    problem = incumbent.problem
    if has_corners(problem.objective, problem.arm) or best.energy is None:
        return
    in_time = problem.duration_max is not None and problem.duration_min == problem.duration_max
    most = best.energy + (settings.gain_in_time if in_time else settings.gain) * (
        coarse - best.energy
    )
    for rival in incumbent.candidates:
        is_open = (
            rival.energy is not None
            and rival.energy < most
            and not rival.refined
            and not rival.refused
        )
        if (
            is_open
            and not (rival.start.sampled or rival.goal.sampled)
            and not incumbent.deadline.passed
        ):
            refine(incumbent, rival)


def lasts_below(ratio: float, incumbent: Incumbent, candidate: Candidate) -> bool:
    """Whether a motion takes less than a multiple of the shortest duration of its joints.

    Then its jerk switches nearly as in the fastest motion.
    """
    displacement = candidate.q_goal - candidate.q_start
    return candidate.spline.duration < ratio * float(
        shortest_duration(displacement, incumbent.problem.arm.active_limits)
    )


def compare_with_baselines(incumbent: Incumbent, best: Candidate) -> list[Baseline]:
    """The baselines, after a feasible baseline of less energy was used as initial guess, first
    coarse, then fine.

    Only the method's `guess_baselines` are initial guesses. If one still needs less energy and is
    of the method's own kind (`accepted_baselines`), it becomes the answer itself: what another
    parametrisation does better is not.
    """
    if incumbent.problem.tool_path is not None or incumbent.problem.passes:
        return baselines_of(incumbent, best)
    table, candidate = _table(incumbent, best)
    for fine in (False, True):
        better = _better(incumbent, table, incumbent.method.guess_baselines)
        if not better or candidate.refused:
            break
        motions = guesses(incumbent.problem, best.q_start, candidate.q_goal, best.duration)
        for name in better:
            if not incumbent.deadline.passed:
                solve_from(incumbent, candidate, (motions[name].q, motions[name].t), fine)
        best = incumbent.best() or best
        table, candidate = _table(incumbent, best)
    accepted = incumbent.method.accepted_baselines
    known: float | None = np.inf
    # one of another duration moves those that are compared in ours
    while (better := _better(incumbent, table, accepted)) and best.energy != known:
        known = best.energy
        accept_baseline(incumbent, candidate, better)
        best = incumbent.best() or best
        table, candidate = _table(incumbent, best)
    # what needs less all the same is not confirmed, and no motion in hand
    return [replace(each, reason=NOT_CONFIRMED) if each.name in better else each for each in table]


def _better(
    incumbent: Incumbent, table: list[Baseline], names: Sequence[BaselineName]
) -> list[BaselineName]:
    """Those of the named baselines that are feasible and need less than the motion they are
    compared with.
    """
    return [
        each.name
        for each in table
        if each.name in names
        and each.within_limits
        and each.saving < -SLACK
        and incumbent.allows(each.duration)
    ]


def baselines_of(incumbent: Incumbent, best: Candidate) -> list[Baseline]:
    """The baselines of a solved candidate as they are, whether they need less or not."""
    if incumbent.problem.tool_path is not None:
        return path_baselines(incumbent, best)
    if incumbent.problem.passes:
        assert best.energy is not None
        return stopping_baselines(incumbent.prepared, best.spline, best.energy)
    return _table(incumbent, best)[0]


def _table(incumbent: Incumbent, best: Candidate) -> tuple[list[Baseline], Candidate]:
    """The baselines from the start of the best candidate to the nearest goal, and the candidate
    between these.
    """
    assert best.energy is not None
    prepared, problem = incumbent.prepared, incumbent.problem
    candidates = incumbent.candidates
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


def accept_baseline(incumbent: Incumbent, candidate: Candidate, better: list[BaselineName]) -> None:
    """Accept the baselines `better` as motions of the candidate, each as an exact spline, if they
    are certified.

    Those that are not certified before the deadline do not count.
    """
    try:
        with watch(incumbent.deadline):
            _accept_certified(incumbent, candidate, better)
    except DeadlinePassed:
        return


def _accept_certified(
    incumbent: Incumbent, candidate: Candidate, better: list[BaselineName]
) -> None:
    best = incumbent.best()
    assert best is not None
    limits, duration = incumbent.problem.arm.active_limits, best.duration
    fastest = time_optimal_spline(limits, candidate.q_start, candidate.q_goal)
    motions: dict[BaselineName, Spline] = {
        "ruckig": fastest,
        "ruckig_slowed": retimed(fastest, duration / fastest.duration),
        "quintic": quintic_spline(candidate.q_start, candidate.q_goal, duration),
    }
    for name in better:
        scale = max(least_time_scale(motions[name], limits.rates), 1.0)
        for spline in (
            incumbent.allowed(retimed(motions[name], slower * scale)) for slower in SLOWER
        ):
            if spline is None:
                continue
            energy = incumbent.prepared.energy(spline)
            if incumbent.certified(candidate, spline, energy).valid:
                incumbent.accept_if_better(
                    candidate,
                    SolveResult(
                        SolveStatus.SOLVED, SolveReason.BASELINE, spline=spline, figures=(name,)
                    ),
                    energy,
                    certified=True,
                )
                break
