"""Goals of free orientation need no more energy than nearby goals or a proposed goal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    BranchFilter,
    ConeOrientedPose,
    Dwell,
    Pose,
    Problem,
    load_robot,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.search.ends import label_of
from joulepath.optimizer.search.near_goals import NEAR_GOALS, activate_near_goals
from joulepath.optimizer.search.sampled_ends import nearest_configuration
from joulepath.optimizer.search.seeds import estimates
from tests.optimizer.search.runs import explored, prepared
from tests.selection import long_but

# s: far more than any search takes, even on a busy machine
AMPLE = 300.0
# relative difference of two searches up to the tolerance of their solves
SAME = 2e-3
# rad: displacement of every joint in a task
STEP = 0.5
# rad: a proposal beside a goal, and how much farther its projection may be
BESIDE = 0.05
FARTHER = 4.0
# relative: an estimate is a quadrature of a few points, of smoothed friction and corners
FEW_POINTS = 1e-2


def task(name: str, seed: int, kind: str, **given: Any) -> tuple[Problem, Array]:
    """A problem with a goal of free orientation, and a goal configuration near the start."""
    arm, rng = Arm(robot=load_robot(name), collisions=False), np.random.default_rng([17, seed])
    limits = arm.active_limits
    start = rng.uniform(*np.clip([0.7 * limits.q_min, 0.7 * limits.q_max], -2.5, 2.5))
    goal = np.clip(start + rng.uniform(-STEP, STEP, len(start)), limits.q_min, limits.q_max)
    T, axis = tcp_pose(arm, goal), np.array([0.0, 0.0, 1.0])
    poses = {
        "about": ConeOrientedPose.about(Pose(T), axis),
        "cone": ConeOrientedPose(T[:3, 3], axis, T[:3, 2], 0.4),
        "free": ConeOrientedPose(T[:3, 3]),
    }
    return Problem(arm=arm, start=start, goal=poses[kind], deadline=AMPLE, **given), goal


CASES = [
    (name, kind, seed)
    for seed in range(3)
    for name in ("xarm7", "panda", "gen3")
    for kind in ("about", "cone")
]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "kind", "seed"),
    long_but((("xarm7", "about", 0),), [*CASES, ("ur5e", "free", 0), ("iiwa14", "free", 1)]),
)
def test_a_goal_needs_no_more_than_a_configuration_of_it_beside_the_start(
    name: str, kind: str, seed: int
) -> None:
    problem, goal = task(name, seed, kind)
    known = optimize(replace(problem, goal=goal)).energy.electrical.total
    answer = optimize(problem)
    assert answer.certificate.valid
    assert answer.lower_bound <= answer.energy.electrical.total <= known * (1 + SAME)


@pytest.mark.long
def test_what_is_activated_is_different_and_may_be_solved() -> None:
    problem, _ = task("xarm7", 3, "cone")
    run = prepared(problem)
    state = run.state
    before = len(state.candidates)
    assert activate_near_goals(state.prepared, state.candidates)
    active = [each for each in state.candidates if not each.deferred and each.holdable]
    fresh = state.candidates[before:]
    assert (
        0 < len(fresh) <= NEAR_GOALS.electrical.count
        and len(active) <= NEAR_GOALS.electrical.count + NEAR_GOALS.others
    )
    for k, each in enumerate(fresh):
        assert each.goal.tolerance is problem.goal and each.lower_bound > 0 and each.shortest > 0
        for other in fresh[:k]:
            assert np.abs(each.q_goal - other.q_goal).max() > NEAR_GOALS.electrical.separation
    # the place of the shortest way is nearer than all samples
    coulomb = problem.arm.friction_law.coulomb
    ways = [np.abs(each.q_goal - each.q_start) @ coulomb for each in state.candidates]
    assert min(ways[before:]) < min(ways[:before])


def test_without_a_free_orientation_nothing_is_activated() -> None:
    problem, goal = task("panda", 0, "about")
    run = prepared(replace(problem, goal=Pose(tcp_pose(problem.arm, goal))))
    assert not activate_near_goals(run.state.prepared, run.state.candidates)


def test_a_full_pose_among_free_ones_is_searched_too() -> None:
    """A distant goal of free orientation, and a nearby full pose reached on self-motions."""
    problem, goal = task("panda", 2, "about")
    far, _ = task("panda", 5, "about")
    both = AnyOf((far.goal, Pose(tcp_pose(problem.arm, goal))))  # type: ignore[arg-type]
    best = explored(replace(problem, goal=both))
    assert best.goal.target == 1 and best.goal.self_motion is not None


@pytest.mark.parametrize("name", ["xarm7", "iiwa14"])
def test_a_proposed_goal_is_put_back_beside(name: str) -> None:
    """A proposed goal is projected to the nearest member of its self-motions.

    A seven-joint arm reaches an orientation on curves, so a few samples are not enough.
    """
    problem, goal = task(name, 4, "about")
    run, rng = prepared(problem), np.random.default_rng(9)
    end = next(each.goal for each in run.state.candidates)
    for _ in range(5):
        asked = goal + rng.uniform(-BESIDE, BESIDE, len(goal))
        found = nearest_configuration(run.state.prepared, end, asked)
        assert found is not None and np.abs(found - asked).max() < FARTHER * BESIDE


def test_a_branch_that_is_asked_for_is_kept() -> None:
    problem, goal = task("xarm7", 0, "about")
    elbow: Any = label_of(problem.arm.robot, goal).split("/")[1]
    assert (
        explored(replace(problem, branch=BranchFilter(elbow=elbow))).goal.label.split("/")[1]
        == elbow
    )


def test_estimates_count_what_waiting_at_a_goal_draws() -> None:
    problem, _ = task(
        "panda",
        1,
        "about",
        dwell=Dwell(time=4.0, hold="motors"),
        duration_min=2.0,
        duration_max=2.0,
    )
    run = prepared(problem)
    some = [each for each in run.state.candidates if each.holdable][:20:4]
    motions = [quintic_spline(each.q_start, each.q_goal, 2.0) for each in some]
    energy = [run.state.prepared.energy(motion).electrical.total for motion in motions]
    np.testing.assert_allclose(estimates(run.state.prepared, some), energy, rtol=FEW_POINTS)
