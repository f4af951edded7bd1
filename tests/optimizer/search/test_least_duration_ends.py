"""Ends that are samples of a target move within it to where the joints need less time."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, ConeOrientedPose, Pose, Problem, load_robot
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.search.least_duration_ends import with_shorter_duration
from joulepath.optimizer.search.sampled_ends import fastest_samples
from tests.optimizer.moves import AMPLE
from tests.optimizer.search.runs import prepared

# m, rad: what the certificate allows at an end
REACHED = 1e-6


def asked(robot: str, seed: int, free: bool) -> Problem:
    """From joint positions to a pose: of a Panda with its posture free, or with any orientation."""
    arm = Arm(robot=load_robot(robot), collisions=False)
    rng = np.random.default_rng(seed)
    limits = arm.robot.limits
    start, goal = rng.uniform(0.8 * limits.q_min, 0.8 * limits.q_max, (2, arm.robot.nq))
    pose = Pose(tcp_pose(arm, goal))
    target = ConeOrientedPose(pose.T[:3, 3]) if free else pose
    return Problem(arm=arm, start=start, goal=target, deadline=AMPLE)


@pytest.mark.long
@pytest.mark.parametrize(("robot", "free"), [("panda", False), ("ur5e", True)])
def test_they_reach_the_target_in_less_time(robot: str, free: bool) -> None:
    helped = 0
    for seed in range(3):
        problem = asked(robot, seed, free)
        run = prepared(problem)
        pose = problem.goal.T if isinstance(problem.goal, Pose) else None
        for candidate in fastest_samples(run.state.candidates)[:4]:
            found = with_shorter_duration(run.state.prepared, candidate)
            if found is None:
                continue
            helped += 1
            assert found.shortest < candidate.shortest
            least = shortest_duration(found.q_goal - found.q_start, problem.arm.active_limits)
            assert found.shortest == pytest.approx(float(least))
            assert (found.q_start == candidate.q_start).all()
            T = tcp_pose(problem.arm, found.q_goal)
            if pose is not None:
                assert np.abs(T - pose).max() < REACHED
            else:
                assert isinstance(problem.goal, ConeOrientedPose)
                assert np.abs(T[:3, 3] - problem.goal.position).max() < REACHED
    assert helped > 3


def test_few_samples_are_tried_also_where_many_are_open() -> None:
    """Otherwise neighbours on one self-motion were searched for their fastest motions in turn."""
    run = prepared(asked("panda", 0, free=False))
    candidates = run.state.candidates
    deferred = fastest_samples(candidates)
    for each in candidates:
        each.activate()
    assert [*map(id, fastest_samples(candidates))] == [*map(id, deferred)]
    assert 0 < len(deferred) < len(candidates) / 4
