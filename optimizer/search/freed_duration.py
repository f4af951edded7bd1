"""A fixed duration: the motion of least energy of any duration, retimed, as another start.

A motion has several local optima, and solves of nearby durations may end in others. What `optimize`
answers without a duration is a motion of its own duration, too: asked for with this duration, it is
found again.
"""

from __future__ import annotations

from dataclasses import replace

from joulepath.optimizer.motion.spline import lasting, sampled
from joulepath.optimizer.search.attempts import solve, solve_from
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.refinement import refine
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus

# greatest ratio of the two durations, and of the two energies, at which the free motion may lead to
# a better one
NEAR, PROMISING = 1.15, 1.01


def start_from_free_duration(incumbent: Incumbent, best: Candidate) -> None:
    """Improve a solved candidate of a fixed duration from its own motion of any duration, if that
    lasts about as long.

    Its own solves come from motions of the fixed duration alone.
    """
    duration = incumbent.problem.duration_max
    if duration is None or not _applies(incumbent):
        return
    free = replace(incumbent.problem, duration_min=None, duration_max=None)
    other = Incumbent(incumbent.prepared.sharing(free), incumbent.end, longest=incumbent.longest)
    twin = Candidate(best.start, best.goal, best.q_start, best.q_goal)
    # beside others, a candidate is solved coarsely first: as it was when no duration was asked for
    beside = (each for each in incumbent.candidates if each is not best and each.holdable)
    other.candidates = [
        twin,
        *(Candidate(each.start, each.goal, each.q_start, each.q_goal) for each in beside),
    ]
    result = solve(other, twin)
    if result.spline is not None and duration / NEAR < result.spline.duration < duration * NEAR:
        other.accept_if_better(twin, result, other.prepared.energy(result.spline))
        refine(other, twin)
        _take(incumbent, best, twin, duration)
    incumbent.iterations += other.iterations
    incumbent.solves += other.solves


def _applies(incumbent: Incumbent) -> bool:
    """Whether the duration is fixed, and a motion of any duration has a duration of its own."""
    problem = incumbent.problem
    fixed = problem.duration_min == problem.duration_max and not incumbent.deadline.passed
    plain = (
        problem.objective == "electrical" and problem.dwell is None and not incumbent.uses_storage
    )
    return fixed and plain and incumbent.method.free_control_points


def _take(incumbent: Incumbent, best: Candidate, twin: Candidate, duration: float) -> None:
    """Accept the motion of `twin`, retimed to `duration` [s], and what is solved from it, if it
    needs less energy.
    """
    assert twin.attempt is not None and best.energy is not None
    motion = lasting(twin.spline, duration)
    before, confirmed = best.energy, incumbent.confirmed_energy(twin, motion)
    if confirmed is not None:
        found = SolveResult(
            SolveStatus.SOLVED,
            SolveReason.FREE_DURATION_RETIMED,
            spline=motion,
            stationarity=twin.attempt.stationarity,
        )
        incumbent.accept_if_better(best, found, confirmed, twin)
    if motion is not twin.spline and incumbent.prepared.cost_of(motion) < PROMISING * before:
        solve_from(incumbent, best, sampled(motion), fine=True)
