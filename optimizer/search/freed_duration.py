"""The motion of least energy of any duration, retimed, as another start for a fixed duration.

A motion has several local optima, and solves of near durations may end in others. Without a
duration `optimize` answers a motion of its own duration; if this duration is then asked for, the
same motion is found again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from joulepath.optimizer.motion.spline import lasting, sampled
from joulepath.optimizer.search.attempts import solve, solve_from
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.refinement import refine
from joulepath.optimizer.search.sharper_cost import sharpen_cost
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


@dataclass(frozen=True)
class FreedDurationSettings:
    """Settings of the start from the motion of free duration."""

    duration_ratio: float = 1.15
    """Greatest ratio of the free to the fixed duration, or of their inverses."""
    energy_ratio: float = 1.01
    """Greatest ratio of the retimed motion's energy to the best at which it is solved from."""


FREED_DURATION = FreedDurationSettings()


def start_from_free_duration(state: SearchState, best: Candidate) -> None:
    """Improve a candidate of fixed duration from its own motion of free duration, if both are near.

    Its own solves start only from motions of the fixed duration.
    """
    duration = state.problem.duration_max
    if duration is None or not _applies(state):
        return
    free = replace(state.problem, duration_min=None, duration_max=None)
    prepared = state.prepared.beside(free)
    other = SearchState(prepared, state.end, longest=state.longest)
    twin = Candidate(best.start, best.goal, best.q_start, best.q_goal)
    # among other candidates, a candidate is solved coarsely first, as without a duration
    beside = (each for each in state.candidates if each is not best and each.holdable)
    other.candidates = [
        twin,
        *(Candidate(each.start, each.goal, each.q_start, each.q_goal) for each in beside),
    ]
    result = solve(other, twin)
    ratio = FREED_DURATION.duration_ratio
    if result.spline is not None and duration / ratio < result.spline.duration < duration * ratio:
        other.accept_if_better(twin, result, other.prepared.energy(result.spline))
        refine(other, twin)
        _take(state, best, twin, duration)
    state.add_search(other)


def _applies(state: SearchState) -> bool:
    """Whether the duration is fixed, and a motion of free duration has a duration of its own."""
    problem = state.problem
    fixed = problem.has_fixed_duration and not state.deadline.passed
    plain = problem.objective == "electrical" and problem.dwell is None and not state.uses_storage
    return fixed and plain and state.method.free_control_points


def _take(state: SearchState, best: Candidate, twin: Candidate, duration: float) -> None:
    """Accept the motion of `twin`, retimed to a duration [s], and motions solved from it."""
    assert twin.attempt is not None and best.energy is not None
    motion = lasting(twin.spline, duration)
    before, confirmed = best.energy, state.confirmed_energy(twin, motion)
    if confirmed is not None:
        found = SolveResult(
            SolveStatus.SOLVED,
            SolveReason.FREE_DURATION_RETIMED,
            spline=motion,
            stationarity=twin.attempt.stationarity,
        )
        state.accept_if_better(best, found, confirmed, twin)
    if (
        motion is not twin.spline
        and state.prepared.cost_of(motion) < FREED_DURATION.energy_ratio * before
    ):
        solve_from(state, best, sampled(motion), fine=True)
        sharpen_cost(state, best)
