"""Free starts of tool paths: the samples of least energy along the path are solved."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from joulepath import Arm, ConeOrientedPose, Pose, Problem, ToolPath, load_robot, optimize
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.seeds import (
    activate_on_path,
    estimates_between,
    estimates_on_path,
)
from tests.optimizer.moves import AMPLE
from tests.optimizer.search.runs import prepared

ARM = Arm(robot=load_robot("panda"), collisions=False)
UP = [0.0, 0.0, 1.0]
START = Pose.from_rotvec([0.35, -0.3, 0.3], [np.pi, 0.0, 0.0])
GOAL = Pose.from_rotvec([0.45, 0.2, 0.25], [np.pi, 0.3, 0.0])
# s; the energy is then that of a single motion
TIME = 3.0
# relative; local optima along one path
SAME = 5e-3


def problem(start: Pose | ConeOrientedPose) -> Problem:
    return Problem(
        arm=ARM,
        start=start,
        goal=GOAL,
        objective="mechanical",
        duration_min=TIME,
        duration_max=TIME,
        tool_path=ToolPath(about=UP, position_tolerance=1e-3),
        deadline=AMPLE,
    )


@cache
def searched() -> Run:
    return prepared(problem(ConeOrientedPose.about(START, UP)))


def test_the_samples_of_least_estimate_are_activated() -> None:
    """The sample of least lower bound is not: the bounds do not know the path."""
    state = searched().state
    energy = estimates_on_path(state.prepared, state.candidates)
    assert activate_on_path(state.prepared, state.candidates)
    active = np.array([not each.deferred for each in state.candidates])
    assert active[energy.argmin()] and 1 < active.sum() <= 12
    assert not active[np.argmin([each.lower_bound for each in state.candidates])]


def test_an_estimate_on_a_straight_line_of_the_joints_is_that_of_the_line() -> None:
    state = searched().state
    known = state.candidates[0]
    q_goal = known.q_start + np.linspace(0.1, 0.4, ARM.robot.nq)
    at = np.linspace(0.0, 1.0, 50)[:, None]
    q = known.q_start + at * (q_goal - known.q_start) + 1e-3
    state.prepared.followed.keep(Trace(q, at[:, 0]))
    line = Candidate(known.start, known.goal, q[0], q[-1])
    expected = estimates_between(state.prepared, q[:1], q[-1:], np.ones(1))
    np.testing.assert_allclose(estimates_on_path(state.prepared, [line]), expected, rtol=1e-9)


@pytest.mark.long
def test_a_free_angle_at_the_start_costs_no_more_than_a_given_one() -> None:
    energy = [
        optimize(problem(start)).energy.mechanical.total
        for start in (START, ConeOrientedPose.about(START, UP))
    ]
    assert energy[1] <= energy[0] * (1 + SAME)
