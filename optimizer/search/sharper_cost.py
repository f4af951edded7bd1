"""Motions of little net energy, solved again with sharper corners of the cost.

The NLP smooths the corners of friction and of the power drawn. The smoothing shifts its cost by
less than a thousandth of the energy flow. If a descending payload provides nearly all of this
energy, the shift reaches some percent of the net energy, and solves with similar durations end in
optima with differences of this size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

from joulepath.optimizer.dynamics.plant import SMOOTHING, has_corners
from joulepath.optimizer.motion.spline import Spline, retimed, sampled
from joulepath.optimizer.search.attempts import in_time, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)


@dataclass(frozen=True)
class SharperCostSettings:
    """Settings of solves with a sharper cost."""

    error: float = 0.01
    """Error of the cost promised by a solve, as a share of the energy, above which the motion is
    solved again. One of 140 random requests on a shared bus is above."""
    duration_ratios: tuple[float, ...] = (0.97, 1.03)
    """Fixed durations of the first solves, in multiples of the duration found."""
    width: float = SMOOTHING.sharper_power_widths[0]
    """Width of the corners of the cost [W]."""
    friction_share: float = 0.15
    """Share of the usual range over which the corners of friction are smoothed [1]."""
    least_nodes: int = 80
    """Least number of quadrature nodes: the usual ones miss corners as sharp as these."""


SHARPER_COST = SharperCostSettings()


def sharpen_cost(
    state: SearchState, candidate: Candidate, settings: SharperCostSettings = SHARPER_COST
) -> None:
    """Improve a motion by solves with a sharper cost, if its cost is imprecise.

    A motion of free duration is solved for several fixed durations near its own, then again with a
    free duration from these solutions: the optimum may be at another local minimum of the energy
    over the duration.

    Args:
        state: state of the search.
        candidate: the solved candidate.
        settings: settings of the solves.
    """
    problem, motion = state.problem, candidate.spline
    if has_corners(problem.objective, problem.arm) or state.uses_storage:
        return
    if not state.method.free_control_points or not _is_imprecise(state, candidate, settings):
        return
    is_fixed = problem.has_fixed_duration
    for usual in duration_intervals(
        state.prepared,
        candidate.q_goal,
        width=settings.width,
        friction_share=settings.friction_share,
    ):
        interval = replace(usual, least_nodes=settings.least_nodes)
        if is_fixed:
            _solved(state, candidate, interval, motion)
            continue
        for ratio in settings.duration_ratios:
            duration = ratio * motion.duration
            if interval.t_min < duration < interval.t_max:
                fixed = replace(interval, t_min=duration, t_max=duration)
                found = _solved(state, candidate, fixed, retimed(motion, ratio))
                if found is not None:
                    _solved(state, candidate, interval, found)


def _is_imprecise(state: SearchState, candidate: Candidate, settings: SharperCostSettings) -> bool:
    """Whether the cost of the NLP differs much from the energy of the motion."""
    promised = None if candidate.attempt is None else candidate.attempt.promised_cost
    if promised is None:
        return False
    cost = state.prepared.cost_of(candidate.spline)
    return abs(promised - cost) > settings.error * abs(cost)


def _solved(
    state: SearchState, candidate: Candidate, interval: DurationInterval, start: Spline
) -> Spline | None:
    """Solve from a motion; the candidate takes the solution if it has less energy.

    Args:
        state: state of the search.
        candidate: the candidate.
        interval: admissible durations.
        start: motion to begin with.

    Returns:
        The solution; None without one, or after the deadline.
    """
    if state.deadline.passed:
        return None
    solver = solver_of(state, candidate, interval)
    result = in_time(state, partial(solver.solve_from, *sampled(start), fine=True))
    if result.spline is not None:
        state.accept_if_better(candidate, result, state.prepared.energy(result.spline))
    return result.spline
