"""Exploration of the candidates, with heuristics for the order where there are many."""

from __future__ import annotations

from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search import branch_and_bound
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.least_work import explore_least_work
from joulepath.optimizer.search.near_goals import activate_near_goals
from joulepath.optimizer.search.outer_turns import explore_families
from joulepath.optimizer.search.path_motions import solve_along_paths
from joulepath.optimizer.search.sampled_ends import activate_deferred
from joulepath.optimizer.search.seeds import activate_on_path, activate_seeds
from joulepath.optimizer.search.sliding import slides
from joulepath.optimizer.search.sliding_work import explore_sliding_work
from joulepath.optimizer.search.state import SearchState


def explore(state: SearchState) -> None:
    """Solve candidates until no lower bound is below the best energy.

    Deferred candidates are solved while there is no motion, and at last motions along planned paths
    are sought.
    """
    if not explore_sliding_work(state) or state.problem.arm.scene.names:
        _activate(state)

    def solve_open() -> None:
        branch_and_bound.explore(
            state.prepared,
            state.candidates,
            lambda candidate: solve(state, candidate),
            state.deadline,
            state.method.most_solved,
            state.tell_tried,
        )

    if not explore_least_work(state, solve_open):
        while True:
            explore_families(state, solve_open)
            is_solved = state.best() is not None and not _has_lost_a_goal(state)
            if is_solved or state.deadline.passed or not _activate(state):
                break
    solve_along_paths(state)


def _has_lost_a_goal(state: SearchState) -> bool:
    """Whether one of the best goals of free orientation has no motion, for the first time.

    If the torque hardly suffices, a goal beside it may have a motion.
    """
    is_lost = any(
        each.status is CandidateStatus.FAILED
        and each.attempt is not None
        and each.attempt.collision is None
        for each in state.candidates
        if each.goal.tolerance is not None
    )
    is_first = is_lost and not state.goal_was_lost
    state.goal_was_lost |= is_lost
    return is_first


def _activate(state: SearchState) -> bool:
    """Activate deferred candidates; false if there are none."""
    prepared, candidates = state.prepared, state.candidates
    if not state.near_goals_activated and state.problem.tool_path is None:
        state.near_goals_activated = True
        if activate_near_goals(prepared, candidates):
            _activate_samples(state, [each for each in candidates if each.goal.tolerance is None])
            return True
    return _activate_samples(state, candidates)


def _activate_samples(state: SearchState, candidates: list[Candidate]) -> bool:
    """Activate some of the given candidates; false if none is deferred."""
    if state.problem.tool_path is not None:
        return activate_on_path(state.prepared, candidates)
    if any(slides(state.prepared, each) for each in candidates if each.sampled):
        return activate_seeds(state.prepared, candidates)
    return activate_deferred(candidates)
