"""Second solve of a candidate within tighter limits, after the certificate rejected its motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.refinement import refine
from joulepath.optimizer.search.state import SearchState

WITHIN_TIGHTER = (
    "converged within tighter limits, after the certificate did not confirm the first motion"
)


@dataclass(frozen=True)
class TightenedLimitSettings:
    """Settings of the second solve of a motion that the certificate rejected."""

    reserve: float = 2e-3
    """Share by which limits become tighter beyond the excess of the rejected motion."""


TIGHTENED_LIMITS = TightenedLimitSettings()


def retry_within_tighter_limits(state: SearchState, candidate: Candidate) -> None:
    """Drop a motion that the certificate did not confirm.

    If it exceeded a limit, the candidate is solved once more, within limits tighter by the excess.
    The new motion is accepted if the certificate confirms it for the original limits.
    """
    tighter = None if candidate.tightened else _tightened(state, candidate)
    state.reject(candidate)
    if tighter is None or state.deadline.passed:
        return
    candidate.tightened = True
    other = SearchState(PreparedProblem.of(replace(state.problem, arm=tighter)), state.end)
    twin = Candidate(candidate.start, candidate.goal, candidate.q_start, candidate.q_goal)
    other.candidates = [twin]
    result = solve(other, twin)
    if result.spline is not None:
        other.accept_if_better(twin, result, other.prepared.energy(result.spline))
        refine(other, twin)
        _take(state, candidate, twin)
    state.add_search(other)


def _tightened(state: SearchState, candidate: Candidate) -> Arm | None:
    """The arm with tighter limits; None if the motion exceeds none of them or follows a path."""
    problem, arm, spline = state.problem, state.problem.arm, candidate.spline
    if problem.tool_path is not None or problem.passes:
        return None
    try:
        with watch(state.deadline):
            worst = state.certified(candidate, spline, state.prepared.energy(spline)).worst_ratio
    except DeadlinePassed:
        return None
    share = {
        name: 1 / (ratio * (1 + TIGHTENED_LIMITS.reserve)) if ratio > 1 else 1.0
        for name, ratio in worst.items()
    }
    if all(each == 1.0 for name, each in share.items() if name != "position"):
        return None
    limits, cone = arm.active_limits, arm.tool_cone
    return replace(
        arm,
        limits=replace(
            limits,
            v_max=limits.v_max * share["velocity"],
            a_max=limits.a_max * share["acceleration"],
            j_max=limits.j_max * share["jerk"],
            tau_max=limits.tau_max * share["torque"],
        ),
        tcp_speed=None if arm.tcp_speed is None else arm.tcp_speed * share["tcp_speed"],
        elbow_speed=None if arm.elbow_speed is None else arm.elbow_speed * share["elbow_speed"],
        tool_cone=None
        if cone is None
        else replace(cone, half_angle=cone.half_angle * share["tool_cone"]),
    )


def _take(state: SearchState, candidate: Candidate, twin: Candidate) -> None:
    """Give the candidate the motion of its `twin` if the certificate confirms it for the own
    limits.
    """
    energy = state.confirmed_energy(twin, twin.spline)
    if energy is not None:
        candidate.move(twin)
        candidate.attempt, candidate.energy = twin.attempt, energy.of(state.problem.objective)
        candidate.settle(CandidateStatus.SOLVED, Reason.METHOD, WITHIN_TIGHTER)
