"""Warm start of a search from a known motion."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.motion.spline import Spline, lasting, sampled
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import solve, solve_from
from joulepath.optimizer.search.sampled_ends import between
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


def warm_start(state: SearchState, spline: Spline) -> None:
    """Solve the candidate of a known motion from this motion and from nothing; the better counts.

    The motion is rescaled in time to the allowed durations. If its certificate is valid, it is
    accepted as it is.
    """
    prepared, problem = state.prepared, state.problem
    q_start, q_goal = spline.control_points[0], spline.control_points[-1]
    candidate = between(prepared, state.candidates, q_start, q_goal)
    if candidate.status is CandidateStatus.INFEASIBLE or state.deadline.passed:
        return
    least, most = problem.duration_min or 0.0, problem.duration_max or np.inf
    known = lasting(spline, float(np.clip(spline.duration, least, most)))
    energy = state.confirmed_energy(candidate, known)
    if energy is not None:
        result = SolveResult(SolveStatus.SOLVED, SolveReason.KNOWN_MOTION_RETIMED, spline=known)
        state.accept_if_better(candidate, result, energy)
    solve_from(state, candidate, sampled(known), fine=problem.method == "time_scaling")
    result = solve(state, candidate)
    if result.spline is None:
        # a known motion is no optimum if solves from it fail; it may be one if they end early
        # because they promise no less energy
        has_failed = result.status is not SolveStatus.PRUNED
        state.cut_short |= has_failed and candidate.motion is known
        return
    state.accept_if_better(candidate, result, prepared.energy(result.spline))
    if state.method.may_refine(result.spline) and candidate.attempt is not result:
        # with few control points the motion needs more energy than the known one, but may lead to a
        # better optimum
        solve_from(state, candidate, sampled(result.spline), fine=False)
