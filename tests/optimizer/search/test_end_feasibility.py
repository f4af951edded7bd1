"""Ends of motions: where the arm can be, and what the bound says of those that are too near to
something.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath import Obstacle, Problem, Scene, Sphere, optimize
from joulepath.optimizer.collision.model import CollisionModel
from tests.optimizer.moves import GOAL, ROBOT, START, changed, problem_with, tcp_pose

# clearance [m] that an end has, less than what is kept of it, and of a ball that touches it
TOO_NEAR = 1e-4
TOUCHING = -1e-4


def beside_goal(asked: Problem, clearance: float) -> Problem:
    """The problem with a ball beside the elbow at GOAL, on its axis, so that the arm has this
    clearance [m] there.
    """
    low, high = 0.0, 1.0
    data = ROBOT.model.createData()
    pin.forwardKinematics(ROBOT.model, data, GOAL)
    T = data.oMi[3].homogeneous

    def with_ball(away: float) -> Problem:
        place = np.eye(4)
        place[:3, 3] = T[:3, 3] + (0.05 + away) * T[:3, 2]
        ball = Obstacle("ball", Sphere(0.05), place, margin=0.0)
        return changed(asked, scene=Scene([ball]))

    for _ in range(40):
        middle = (low + high) / 2
        near = CollisionModel(with_ball(middle).arm).least_distance(GOAL[None], 0.1) < clearance
        low, high = (middle, high) if near else (low, middle)
    return with_ball(high)


def test_an_end_whose_clearance_is_too_small_to_plan_for_counts_in_the_bound() -> None:
    """Other motions may go there, and need less than the answer, which does not claim to be the
    best. One may be found as a baseline."""
    asked = problem_with(START, tcp_pose(GOAL), windings=False)
    free = optimize(asked)
    assert np.allclose(free.goal.q, GOAL)
    near = optimize(beside_goal(asked, TOO_NEAR))
    assert near.lower_bound <= free.energy.electrical.total < near.energy.electrical.total
    assert near.status == "feasible"
    touched = optimize(beside_goal(asked, TOUCHING))
    (ruled,) = [each for each in touched.candidates if np.allclose(each.q_goal, GOAL)]
    assert ruled.status == "infeasible" and "ball" in ruled.reason and np.isinf(ruled.lower_bound)
    assert touched.lower_bound > near.lower_bound and touched.status == "optimal"
