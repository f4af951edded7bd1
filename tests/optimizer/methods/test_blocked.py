"""A candidate that fails because of an obstacle: its result carries the collision, and the error names the pair."""

from __future__ import annotations

import numpy as np
import pytest

from models.robot import Array
from optimizer.deadline import Deadline
from optimizer.energy.kernel_cache import compile_kernel
from optimizer.exceptions import NoCollisionFreeTrajectory
from optimizer.methods import solver_for
from optimizer.methods.method import SolveStatus
from optimizer.optimize import optimize
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import Problem
from optimizer.problem.scene import Box, Obstacle, Scene, Sphere
from tests.optimizer.moves import ROBOT, problem_with

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = np.array([-1.8, -1.57, 1.57, -1.57, -1.57, 0.0])
DEADLINE = 30.0


def placed(x: float, y: float, z: float, yaw: float = 0.0) -> Array:
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = x, y, z
    return T


# on the straight line in joint space; a method that avoids obstacles passes it
POST = Obstacle("post", Sphere(0.06), placed(-0.45, 0.35, 0.5))
# a wall that leads outwards from the base, between start and goal, and beside the upper arm at the goal
WALL = Obstacle(
    "wall", Box(np.array([1.2, 0.02, 2.4])), placed(-0.8 * 0.8, 0.6 * 0.8, 0.0, np.arctan2(0.6, -0.8)), margin=0.0
)


def blocked(method: str, obstacle: Obstacle) -> Problem:
    return problem_with(START, GOAL, scene=Scene((obstacle,)), method=method, deadline=DEADLINE)


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    compile_kernel(ROBOT)


@pytest.mark.parametrize(
    ("method", "obstacle"),
    [
        ("polynomial_ga", POST),
        ("uniform_scaling", POST),
        ("time_scaling", POST),
        ("polynomial_ga", WALL),
        ("uniform_scaling", WALL),
        ("time_scaling", WALL),
        ("lagrange", WALL),
    ],
    ids=lambda value: value.name if isinstance(value, Obstacle) else value,
)
def test_the_error_names_the_colliding_pair(method: str, obstacle: Obstacle) -> None:
    problem = blocked(method, obstacle)
    with pytest.raises(NoCollisionFreeTrajectory) as caught:
        optimize(problem)
    assert obstacle.name in caught.value.pair and caught.value.depth > 0
    assert all(obstacle.name in candidate.reason for candidate in caught.value.candidates)
    result = solver_for(PreparedProblem.of(problem), START, GOAL, Deadline.after(DEADLINE)).solve()
    assert result.status in (SolveStatus.FAILED, SolveStatus.INFEASIBLE) and result.spline is None
    assert result.collision is not None and obstacle.name in result.collision.pair


@pytest.mark.parametrize("method", ["bspline", "lagrange"])
def test_a_method_that_avoids_obstacles_passes_the_post(method: str) -> None:
    solution = optimize(blocked(method, POST))
    assert solution.certificate.clearance is not None and solution.certificate.clearance.min_clearance >= 0
