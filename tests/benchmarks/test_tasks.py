from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tasks import KINDS, flange, move, moves, request_task, request_tasks
from joulepath import Robot, load_robot
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for

POSE_ERROR = 1e-12  # rounding of a few products of rotations


@pytest.fixture
def robot() -> Robot:
    return load_robot("ur5e")


def test_a_task_is_its_seed_and_index() -> None:
    again = list(moves(3, 4))[2]
    assert np.array_equal(move(3, 2).q_start, again.q_start) and np.array_equal(
        move(3, 2).q_goal, again.q_goal
    )
    assert request_task(3, 2).body == list(request_tasks(3, 4))[2].body
    assert request_task(3, 2).body != request_task(3, 3).body != request_task(4, 3).body


def test_moves_are_within_one_turn_and_the_limits(robot: Robot) -> None:
    q = np.array([end for task in moves(0, 200) for end in (task.q_start, task.q_goal)])
    assert (
        (q >= robot.limits.q_min).all()
        and (q <= robot.limits.q_max).all()
        and np.abs(q).max() <= np.pi
    )
    # drawn evenly: both halves of every joint's range, and its outer tenths, are reached
    assert (q.min(axis=0) < -0.9 * np.pi).all() and (q.max(axis=0) > 0.9 * np.pi).all()


@pytest.mark.parametrize("index", range(20))
def test_requests_are_valid_and_reachable(robot: Robot, index: int) -> None:
    task = request_task(0, index)
    assert task.kind == KINDS[index % 2]
    problem = to_problem(OptimizeRequest.model_validate(task.body), 10.0)
    for target, T in ((problem.start, task.T_start), (problem.goal, task.T_goal)):
        reached = flange(robot, target) if isinstance(target, np.ndarray) else target.T
        assert np.abs(reached - T).max() < POSE_ERROR
        assert inverse_kinematics_for(robot).branches(T)
