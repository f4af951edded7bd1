"""Motions with sharp corners: less energy than those of the smoothed cost, and only where every
joint has a corner.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Bus, Problem, optimize
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.attempts import solve
from joulepath.optimizer.search.branch_and_bound import explore
from joulepath.optimizer.search.sharpening import sharpen
from joulepath.optimizer.search.state import SearchState
from tests.optimizer.moves import AMPLE, ROBOT, problem
from tests.optimizer.search.runs import prepared

# relative; what is promised against the best of many starts on as many control points
PROMISED = 5e-3
# a motion in a given time [s], and the least mechanical energy [J] that is known of it
BEST_START = np.array(
    [-1.0563769171, 0.7030631375, 0.0479574165, -2.1595422481, 1.9102876515, -3.0230673183]
)
BEST_GOAL = np.array(
    [-2.6596545658, -0.3932695539, 2.8468960492, 1.9756345344, -1.3513098591, 0.5445385554]
)
BEST_DURATION, BEST_ENERGY = 3.977043743, 44.05294296


def explored(**given: Any) -> SearchState:
    """A search whose candidates are solved, but not refined."""
    run = prepared(problem(**given))
    state = run.state
    explore(
        state.prepared,
        state.candidates,
        lambda each: solve(state, each),
        state.deadline,
    )
    return state


def test_as_good_as_the_best_of_many_starts() -> None:
    """Mechanical work at a fixed duration, against the best of 16 starts on 40 control points."""
    task = Problem(
        arm=Arm(robot=ROBOT, collisions=False),
        start=BEST_START,
        goal=BEST_GOAL,
        objective="mechanical",
        duration_min=BEST_DURATION,
        duration_max=BEST_DURATION,
        deadline=AMPLE,
    )
    assert optimize(task).energy.mechanical.total <= BEST_ENERGY * (1 + PROMISED)


@pytest.mark.parametrize(
    "given",
    [
        {"objective": "mechanical", "duration_max": 1.5},
        pytest.param({"bus": Bus(mode="isolated")}, marks=pytest.mark.long),
    ],
)
def test_sharper_corners_need_less(given: dict[str, Any]) -> None:
    state = explored(**given)
    before = state.best()
    assert before is not None and before.energy is not None
    energy = before.energy
    sharpen(state, before)
    after = state.best()
    assert after is not None and after.energy is not None
    assert after.energy < energy
    # the candidate's energy is that of its motion, by the exact formulas
    prepared: PreparedProblem = state.prepared
    assert after.energy == prepared.objective_of(prepared.energy(after.spline))


@pytest.mark.parametrize(
    "given", [{}, {"method": "uniform_scaling", "objective": "mechanical", "duration_max": 1.5}]
)
def test_nothing_is_solved_again_without_corners_or_even_spacing(given: dict[str, Any]) -> None:
    state = explored(**given)
    best = state.best()
    assert best is not None
    spline, solves = best.spline, state.solves
    sharpen(state, best)
    assert best.spline is spline and state.solves == solves


def test_no_time_is_left() -> None:
    """The motion stays as it is."""
    state = explored(objective="mechanical", duration_max=1.5)
    best = state.best()
    assert best is not None
    spline = best.spline
    state.end = Deadline.after(-1.0)
    sharpen(state, best)
    assert best.spline is spline
