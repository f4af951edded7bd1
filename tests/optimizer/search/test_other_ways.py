"""Planned paths to other postures as initial guesses of motions of least work."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Box, Obstacle, Pose, Problem, Scene, load_robot
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.search import stages
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.other_ways import OTHER_WAYS, explore_other_ways, quickest
from joulepath.optimizer.search.seeds import estimates
from joulepath.optimizer.search.state import SearchState
from tests.optimizer.placement.cells import at

ROBOT = load_robot("panda")
HOME = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])
REACHED = np.array([1.2, 0.5, -0.3, -1.9, 0.3, 2.3, 0.6])


WALL = Obstacle("wall", Box(np.array([0.5, 0.04, 0.5])), at(0.45, 0.2, 0.25), margin=0.0)
ARM = Arm(robot=ROBOT, scene=Scene([WALL]))
GOAL = Pose(tcp_pose(ARM, REACHED[None])[0])
QUICK = 1.1  # s
BETTER = 0.97  # ratio of energies; it was 0.94
PROBLEM = Problem(
    arm=ARM,
    start=HOME,
    goal=GOAL,
    objective="mechanical",
    duration_min=1.5,
    duration_max=1.5,
    deadline=60.0,
)


def with_one_motion(problem: Problem) -> SearchState:
    """A search with one solved candidate, the quick posture with the largest estimate."""
    state = SearchState.of(problem)
    stages.prepare(state)
    quick = [each for each in state.candidates if each.holdable and each.shortest < QUICK]
    chosen = quick[int(estimates(state.prepared, quick).argmax())]
    chosen.activate()
    result = solve(state, chosen)
    assert result.spline is not None
    state.accept_if_better(chosen, result, state.prepared.energy(result.spline))
    return state


def test_a_better_posture_is_found_around_the_obstacle() -> None:
    state = with_one_motion(PROBLEM)
    (first,) = [each for each in state.candidates if each.energy is not None]
    before = first.energy
    explore_other_ways(state)
    best = state.best()
    assert best is not None and best is not first and not best.deferred
    assert best.energy is not None and before is not None and best.energy < BETTER * before
    assert best.spline.duration == pytest.approx(1.5, abs=1e-12)
    assert state.prepared.surroundings.worst_violation(best.spline) is None
    reached = tcp_pose(ARM, best.spline.control_points[-1:])[0]
    np.testing.assert_allclose(reached, GOAL.T, atol=1e-6)


def test_several_separate_postures_of_every_curve_are_tried_the_quickest_first() -> None:
    state = SearchState.of(PROBLEM)
    stages.prepare(state)
    chosen = quickest(state)
    curves = [each.goal.self_motion for each in chosen]
    first = {curve: curves.index(curve) for curve in curves}
    assert max(first.values()) < len(first)
    for each in chosen:
        same = [other for other in chosen if other.goal.self_motion is each.goal.self_motion]
        assert len(same) <= OTHER_WAYS.postures
        assert all(
            np.abs(each.q_goal - other.q_goal).max() > OTHER_WAYS.separation
            for other in same
            if other is not each
        )
        assert chosen[first[each.goal.self_motion]].shortest <= each.shortest
    assert max(curves.count(curve) for curve in first) == OTHER_WAYS.postures


@pytest.mark.parametrize("other", ["electrical", "no obstacles"])
def test_nothing_else_is_explored(other: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The exploration does nothing for electrical energy, and nothing without obstacles."""
    problem = (
        replace(PROBLEM, objective="electrical")
        if other == "electrical"
        else replace(PROBLEM, arm=replace(ARM, scene=Scene()))
    )
    state = with_one_motion(problem)
    solves = state.solves
    explore_other_ways(state)
    assert state.solves == solves
