"""The search between the ends of the best motion: a free orientation needs no more than its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import Arm, ConeOrientedPose, Pose, Problem, load_robot, optimize
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.search import free_goal
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.stages import solve_between_best_ends
from tests.optimizer.moves import AMPLE
from tests.optimizer.search.runs import prepared

ARM = Arm(robot=load_robot("iiwa14"), collisions=False)
START = np.array([0.3, 0.5, -0.4, -1.2, 0.3, 0.9, 0.2])
GOAL = Pose(tcp_pose(ARM, np.array([-0.5, 0.9, 0.3, -1.5, -0.6, 1.1, -0.4])))
# relative; local optima of the same posture, from two starts
SAME = 1e-3


def problem(goal: Any) -> Problem:
    return Problem(arm=ARM, start=START, goal=goal, deadline=AMPLE)


def test_the_orientation_of_the_best_motion_is_searched_like_a_given_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only the candidate of greatest bound is solved: other postures at its pose need far less."""
    # turning the goal further takes seconds without a compiled kernel
    monkeypatch.setattr(free_goal, "refine_goal", lambda _, candidate: candidate)
    state = prepared(problem(ConeOrientedPose.about(GOAL, [0, 0, 1]))).state
    dearest = max(state.candidates, key=lambda each: each.lower_bound)
    dearest.activate()
    result = solve(state, dearest)
    assert result.spline is not None
    state.accept_if_better(dearest, result, state.prepared.energy(result.spline))
    solve_between_best_ends(state)
    best = state.best()
    assert best is not None and best.energy is not None
    given = optimize(problem(Pose(tcp_pose(ARM, dearest.q_goal)))).energy.electrical.total
    assert best.energy <= given * (1 + SAME) < (dearest.energy or 0.0)
    # the search runs once
    solve_between_best_ends(state)
    assert state.best() is best
