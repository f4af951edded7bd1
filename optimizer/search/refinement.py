"""Refinement of motions: finer spaces, other starts, other values of the surplus."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.motion.spline import sampled
from joulepath.optimizer.search.attempts import improve, solve_from
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sharpening import sharpen
from joulepath.optimizer.search.sharper_cost import sharpen_cost
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.free_spline import FREE_SPLINE
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveResult


@dataclass(frozen=True)
class RefinementSettings:
    """Settings of the refinement of a motion."""

    surplus_shares: tuple[float, ...] = (0.95, 0.9, 0.85, 0.8, 0.65, 0.5, 0.25)
    """Assumed values of a joule of surplus if the storage cannot take all of it.

    They are shares of the way from the price that the supply pays to the share that the storage
    gives back. The optimum often lies where the storage just takes all surplus, and a joule of
    surplus is worth nearly the highest value there. Shares above 0.75 saved 1.3 % and 0.7 % in 2 of
    60 random requests.
    """
    least_charged: float = 1e-6
    """Energy that a motion stores, as a share of the energy it needs, above which other values of a
    joule of surplus are tried."""


REFINEMENT = RefinementSettings()


@dataclass(frozen=True)
class FastestStartSettings:
    """Settings of the solves from the time-optimal motion of a candidate.

    Such a solve takes as long as a refinement, and most solves find nothing better. In six of 80
    random requests, the solves saved 0.05 % or more; the conditions select four of these six.
    """

    held_back: float = 1.5
    """Ratio of the duration to the shortest duration of the joints above which active path
    constraints hold the motion back. The jerk then switches at other instants than in the first
    solve, and the local optima differ by up to 1.7 %. Below this ratio, the solves gained
    nothing."""
    active: float = 0.98
    """Ratio of a path constraint to its limit above which the constraint is active."""


FASTEST_START = FastestStartSettings()


def refine(state: SearchState, candidate: Candidate) -> None:
    """Improve the motion of a solved candidate as far as the method and the deadline allow."""
    method, deadline = state.method, state.deadline
    candidate.refined = True
    sharpen(state, candidate)
    if method.may_refine(candidate.spline) and not deadline.passed:
        coarse = candidate.spline
        exact = state.lasts_below(FREE_SPLINE.exact_below, candidate)
        improve(state, candidate, lambda solver: solver.refined(coarse, fine=exact))
        if exact and candidate.spline is coarse and not state.deadline.passed:
            improve(state, candidate, lambda solver: solver.refined(coarse, fine=False))
    if method.may_grade(candidate.spline) and not deadline.passed:
        solve_from(state, candidate, sampled(candidate.spline), fine=True)
    start_from_fastest(state, candidate)
    sharpen_cost(state, candidate)
    if method.guess_baselines and _stores_energy(state, candidate):
        _value_surplus_otherwise(state, candidate)


def _stores_energy(state: SearchState, candidate: Candidate) -> bool:
    """Whether the storage takes energy in a candidate's motion: only then its value matters."""
    energy = state.prepared.energy(candidate.spline)
    least = REFINEMENT.least_charged * abs(energy.electrical.total)
    return energy.storage is not None and energy.storage.charged > least


def _value_surplus_otherwise(state: SearchState, candidate: Candidate) -> None:
    """Improve a candidate by solves with other values of the surplus."""
    supply, most = state.problem.arm.regeneration, state.problem.arm.bus.efficiency
    for share in REFINEMENT.surplus_shares:
        if not state.deadline.passed:
            value = supply + share * max(most - supply, 0.0)
            solve_from(state, candidate, sampled(candidate.spline), fine=False, surplus_value=value)


def start_from_fastest(state: SearchState, candidate: Candidate) -> None:
    """Improve a candidate by solves from its time-optimal motion, if path constraints hold it back.

    The first solve starts from a smoothed time-optimal motion on few control points, and the
    refinement stays near the resulting optimum.

    Args:
        state: state of the search.
        candidate: the solved candidate.
    """
    problem = state.problem
    if has_corners(problem.objective, problem.arm) or state.uses_storage:
        return
    if _is_held_back(state, candidate):
        for duration in (0.0, candidate.spline.duration):
            if not state.deadline.passed:
                improve(state, candidate, partial(_solve_from_fastest, duration))


def _solve_from_fastest(duration: float, solver: Method) -> SolveResult:
    return solver.solve_from_fastest(duration)


def _is_held_back(state: SearchState, candidate: Candidate) -> bool:
    """Whether path constraints make a motion much slower than the limits of its joints."""
    path, spline = state.prepared.path, candidate.spline
    if path is None or state.lasts_below(FASTEST_START.held_back, candidate):
        return False
    q, t = sampled(spline)
    return bool(path.ratios(q, spline.curve(t, 1)).max() > FASTEST_START.active)


@dataclass(frozen=True)
class RivalSettings:
    """Settings of the refinement of other candidates with sliding ends.

    Between fixed ends, it changed no energy of 160 random requests.
    """

    gain: float = 1.25
    """Multiple of the best candidate's gain that would bring a rival's energy below the best."""
    distinct: float = 0.1
    """Distance of ends from those of a refined motion [rad] above which sliding ends are at another
    optimum. Ends at one optimum differ by a few hundredths."""


RIVALS = RivalSettings()


def refine_rivals(state: SearchState, best: Candidate, coarse: float) -> None:
    """Refine candidates with sliding ends at other optima, if they may come below the best.

    Args:
        state: state of the search.
        best: the best candidate, refined.
        coarse: its energy before it was refined [J].
    """
    problem = state.problem
    if has_corners(problem.objective, problem.arm) or best.energy is None:
        return
    most = best.energy + RIVALS.gain * (coarse - best.energy)
    for rival in state.candidates:
        if rival.energy is None or rival.refined or rival.refused or state.deadline.passed:
            continue
        if rival.energy < most and _is_elsewhere(state, rival):
            refine(state, rival)


def _is_elsewhere(state: SearchState, rival: Candidate) -> bool:
    """Whether a candidate has sliding ends far from those of the refined candidates."""
    ends = np.concatenate([rival.q_start, rival.q_goal])
    return slides(state.prepared, rival) and all(
        np.abs(np.concatenate([each.q_start, each.q_goal]) - ends).max() > RIVALS.distinct
        for each in state.candidates
        if each.refined
    )
