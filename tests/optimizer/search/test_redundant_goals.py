"""Poses of arms with seven joints: none of their configurations needs less than answer or bound."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    GoalInCollision,
    JoulepathError,
    Obstacle,
    Pose,
    Problem,
    Robot,
    Scene,
    Sphere,
    StartInCollision,
    load_robot,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.self_motion_bound import self_motion_bound
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import bound, pairs
from joulepath.optimizer.search.ends import SAMPLING, ends
from tests.selection import long_but

# relative: the least step along a curve and the solver's tolerance
REFINED = 1e-3
# relative
ROUNDING = 1e-12
# s: far more than any search takes, even on a busy machine
AMPLE = 300.0
# least distance of links from each other at the ends of a task [m]
CLEAR = 0.01


@cache
def tasks(name: str, count: int) -> list[tuple[Array, Array]]:
    """Random start and goal configurations without contact between links."""
    robot = load_robot(name)
    drawn = np.random.default_rng(61).uniform(
        robot.limits.q_min, robot.limits.q_max, (4 * count + 8, robot.nq)
    )
    clear = drawn[collision_model(Arm(robot=robot)).signed_distances(drawn)[0].min(axis=1) > CLEAR]
    return [(clear[2 * k], clear[2 * k + 1]) for k in range(count)]


def asked(robot: Robot, start: Any, goal: Any, **given: Any) -> Problem:
    return Problem(arm=Arm(robot=robot), start=start, goal=goal, deadline=AMPLE, **given)


def pose_of(robot: Robot, q: Array) -> Pose:
    return Pose(tcp_pose(Arm(robot=robot), q))


def members(robot: Robot, q: Array, count: int, seed: int) -> list[Array]:
    """Random configurations of the pose of q within the limits, spread evenly over its curves."""
    inverse, rng = required_inverse_kinematics(robot, "goal"), np.random.default_rng(seed)
    curves: dict[SelfMotion, SelfMotion] = {}
    for each in inverse.solve(pose_of(robot, q).T):
        if each.self_motion is not None:
            curves[each.self_motion] = each.self_motion
    arcs = [(curve, *arc) for curve in curves.values() for arc in curve.arcs]
    lengths = np.array([upper - lower for _, lower, upper in arcs])
    found: list[Array] = []
    while len(found) < count:
        curve, lower, upper = arcs[rng.choice(len(arcs), p=lengths / lengths.sum())]
        member = curve.at(rng.uniform(lower, upper, 1))[0]
        middle = (robot.limits.q_min + robot.limits.q_max) / 2
        member = member + 2 * np.pi * np.round((middle - member) / (2 * np.pi))
        if ((member >= robot.limits.q_min) & (member <= robot.limits.q_max)).all():
            found.append(member)
    return found


@pytest.mark.parametrize(
    ("name", "count", "fixed"),
    long_but((("panda", 1, 3),), [("panda", 1, 3), ("panda", 10, 10), ("iiwa14", 10, 10)]),
)
def test_a_pose_needs_no_more_than_any_of_its_configurations(
    name: str, count: int, fixed: int
) -> None:
    robot = load_robot(name)
    for start, goal in tasks(name, count):
        answer = optimize(asked(robot, start, pose_of(robot, goal)))
        assert answer.certificate.valid and answer.status == "feasible"
        energy = answer.energy.electrical.total
        assert answer.lower_bound <= energy
        for member in members(robot, goal, fixed, seed=62):
            try:
                other = optimize(asked(robot, start, member)).energy.electrical.total
            except JoulepathError:
                continue  # in collision there
            assert energy <= other * (1 + REFINED)
            assert answer.lower_bound <= other


@pytest.mark.parametrize(
    ("name", "task", "member"),
    [
        # at another optimum, 0.3 % lower after the refinement and higher before
        ("panda", 10, [-0.682, -0.514, 0.322, -1.434, 2.248, 3.442, -2.314]),
        # between the last regular sample of the curve and a limit, 3 % lower
        ("iiwa14", 16, [-0.963, -0.108, 0.473, 0.23, -2.834, 0.118, 0.025]),
    ],
)
def test_optima_that_samples_hardly_show_are_found(
    name: str, task: int, member: list[float]
) -> None:
    robot = load_robot(name)
    start, goal = tasks(name, task + 1)[task]
    pose, other = pose_of(robot, goal), pose_of(robot, np.array(member))
    # a member is written with three digits
    assert np.abs(pose.T - other.T).max() < 5e-3
    needed = optimize(asked(robot, start, pose)).energy.electrical.total
    assert needed <= optimize(asked(robot, start, member)).energy.electrical.total


@pytest.mark.parametrize(
    ("name", "at_start"),
    long_but([("panda", False), ("iiwa14", True)], product(("panda", "iiwa14"), (False, True))),
)
def test_no_member_has_a_lower_bound_below_the_curves(name: str, at_start: bool) -> None:
    robot = load_robot(name)
    for start, goal in tasks(name, 3):
        one = (pose_of(robot, goal), start) if at_start else (start, pose_of(robot, goal))
        prepared = PreparedProblem.of(asked(robot, *one))
        whole = self_motion_bound(
            prepared, pairs(prepared, ends(prepared, "start")[0], ends(prepared, "goal")[0])
        )
        assert 0 < whole < np.inf
        for member in members(robot, goal, 30, seed=63):
            alone = PreparedProblem.of(
                asked(robot, *((member, start) if at_start else (start, member)))
            )
            candidates = pairs(alone, ends(alone, "start")[0], ends(alone, "goal")[0])
            try:
                bound(alone, candidates)
            except JoulepathError:
                continue
            assert min(each.lower_bound for each in candidates) >= whole * (1 - ROUNDING)


ROBOT = load_robot("panda")
AT_HOME = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])
T_NARROW = tcp_pose(Arm(robot=ROBOT), np.array([[0.3, 0.4, -0.2, -1.9, 0.3, 2.2, 0.6]]))[0]
# balls in contact with every coarse sample but not with all other members, found by a search
BALLS = ([0.354, -0.104, 0.443], [0.559, 0.103, 0.41], [0.103, -0.2, 0.289], [0.023, -0.154, 0.3])


def among(*centres: list[float]) -> Arm:
    placed = [np.vstack([np.column_stack([np.eye(3), c]), [0, 0, 0, 1]]) for c in centres]
    return Arm(
        robot=ROBOT,
        scene=Scene(
            [Obstacle(f"ball {k}", Sphere(0.01), at, margin=0.0) for k, at in enumerate(placed)]
        ),
    )


def clearance(arm: Arm, q: Array) -> Array:
    model = CollisionModel(arm)
    return np.asarray(model.pair_distances(model.frames(q)).distance.min(axis=1))


@pytest.mark.parametrize("end", long_but(["goal"], ["start", "goal"]))
def test_a_posture_between_colliding_samples_is_found(end: str) -> None:
    arm = among(*BALLS)
    samples = required_inverse_kinematics(ROBOT, "goal").solve(
        T_NARROW, None, ROBOT.limits, windings=False, members=SAMPLING.members
    )
    assert len(samples) > 50
    assert (clearance(arm, np.array([each.q for each in samples])) < 0).all()
    ends = {"start": AT_HOME, "goal": AT_HOME, end: Pose(T_NARROW)}
    found = optimize(Problem(arm=arm, **ends))  # type: ignore[arg-type]
    assert found.certificate.clearance is not None
    assert found.certificate.clearance.min_clearance >= 0
    q = found.trajectory.spline.curve(0.0 if end == "start" else found.duration)
    np.testing.assert_allclose(tcp_pose(arm, q[None])[0], T_NARROW, atol=1e-6)
    assert clearance(arm, q[None])[0] >= CLEARANCE_CONSTRAINT.reserve - 1e-9


@pytest.mark.parametrize(("end", "error"), [("start", StartInCollision), ("goal", GoalInCollision)])
def test_a_pose_without_a_free_posture_is_refused(end: str, error: type[Exception]) -> None:
    """A ball encloses the flange, a fixed point of the self-motion."""
    arm = among(*BALLS, T_NARROW[:3, 3].tolist())
    ends: dict[str, Any] = {"start": AT_HOME, "goal": AT_HOME, end: Pose(T_NARROW)}
    with pytest.raises(error):
        optimize(Problem(arm=arm, **ends))
