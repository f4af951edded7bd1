"""Motions with much time rest where the motors hold the arm at little power."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Dwell, Payload, Problem, Waypoints, evaluate, optimize
from joulepath.optimizer.problem.problem import DURATIONS
from tests.optimizer.moves import ROBOT

ARM = Arm(robot=ROBOT, payload=Payload(mass=5.0), collisions=False)
WAY = 2.0
"""Duration of a way by hand [s]."""


@pytest.mark.parametrize(
    ("start", "rest", "goal", "time", "given"),
    [
        pytest.param(
            [0.0, 0.0, 0.3, 0.0, 0.0, 0.0],
            [0.0, -1.6, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.3, 0.0, 0.0, 0.0],
            8.0,
            {"dwell": Dwell(8.0)},
            id="no slope leads away from waiting between equal ends",
        ),
        pytest.param(
            [0.1, 0.6, -0.2, -1.8, 0.2, -1.9],
            [0.1, 1.6, -0.1, -1.6, -0.1, -1.9],
            [0.4, 0.2, -0.3, -2.0, -0.1, -1.9],
            15.0,
            {"duration_min": 15.0, "duration_max": 15.0},
            id="the slope leads upwards and the better rest is hanging",
            marks=pytest.mark.long,
        ),
    ],
)
def test_it_needs_less_than_a_rest_by_hand(
    start: list[float], rest: list[float], goal: list[float], time: float, given: dict[str, Any]
) -> None:
    by_hand = Waypoints(np.array([start, rest, rest, goal]), [WAY, time - 2 * WAY, WAY], "quintic")
    evaluated = evaluate(ARM, by_hand, progress=False)
    assert all(report.held for report in evaluated.limits)
    problem = Problem(arm=ARM, start=start, goal=goal, windings=False, **given)
    found = optimize(problem).energy.electrical.total
    assert found < evaluated.total.energy.electrical.total


def test_a_long_dwell_keeps_an_answer_that_is_certified_in_time() -> None:
    """The certificate of a motion of ten minutes takes longer than the deadline, in time of the
    processor."""
    start = [0.0, -0.3, 0.3, 0.0, 0.0, 0.0]
    goal = [0.3, -0.2, 0.1, 0.0, 0.1, 0.0]
    arm, dwell = Arm(robot=ROBOT, collisions=False), Dwell(3600.0)
    problem = Problem(arm=arm, start=start, goal=goal, windings=False, dwell=dwell, deadline=1.5)
    found = optimize(problem, clock=time.process_time)
    assert found.status == "feasible"
    assert found.duration < DURATIONS.longest
