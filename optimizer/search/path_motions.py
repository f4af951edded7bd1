"""Motions along planned paths, where solves from these paths end in collisions.

The nonlinear program may find no way back from a collision in a narrow space. A smooth path has a
proven clearance, and only its time law remains to be found. Usually there is one, unless the
durations are limited, or the motors cannot hold the arm on its way.
"""

from __future__ import annotations

from joulepath.optimizer.motion.spline import sampled
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import context_of, in_time, solve_from
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods import method_of
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.time_scaling import TimeScaling


def solve_along_paths(state: SearchState) -> None:
    """If no candidate has a motion, solve the failed candidates along their planned paths, and then
    freely from the motions along these paths.

    Methods that are restricted to motions of another form are left out.
    """
    if state.best() is not None or method_of(state.problem) is not FreeSpline:
        return
    surroundings = state.prepared.surroundings
    for candidate in state.candidates:
        ends = candidate.q_start, candidate.q_goal
        has_failed = candidate.status is CandidateStatus.FAILED
        if has_failed and not state.deadline.passed and surroundings.has_planned_paths(*ends):
            _solve(state, candidate)


def _solve(state: SearchState, candidate: Candidate) -> None:
    for interval in duration_intervals(state.prepared, candidate.q_goal):
        context = context_of(state, candidate, interval)
        result = in_time(state, TimeScaling(context).solve)
        if result.spline is not None:
            state.accept_if_better(candidate, result, state.prepared.energy(result.spline))
    if candidate.motion is not None:
        solve_from(state, candidate, sampled(candidate.motion), fine=False)
