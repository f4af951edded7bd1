"""Boxes hold every configuration of a pose, and the bound between two poses no motion undercuts."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, Pose, Problem
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.bounds.missed_branches import all_branches_known, bound_of_missed_branches
from joulepath.optimizer.bounds.pose_cover import POSE_COVER, CoveredPose, united
from joulepath.optimizer.bounds.subdivide import SearchLimits
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate, pairs
from joulepath.optimizer.search.ends import ends
from tests.optimizer.kinematics.axis_patterns import UR_AXES, random_axes, robot_of
from tests.optimizer.kinematics.six_joints import KUKA, UR5E, calibrated, flange, inside
from tests.selection import long_but

ROUNDING = 1e-9
# pose error of a configuration found by Newton's method [m, rad]
EXACT = 1e-11
STARTS = 200
# bounds of common arms over the least bound of any pair of configurations
NEAR = 0.6


def beside_fifth(by: float) -> Robot:
    """UR5e with a given distance [m] between its fifth and sixth axis."""
    points, T_zero = UR_AXES.points.copy(), UR_AXES.T_zero.copy()
    shift = by * np.cross(UR_AXES.directions[4], UR_AXES.directions[5])
    points[5] += shift
    T_zero[:3, 3] += shift
    return robot_of(JointAxes(UR_AXES.directions, points, T_zero))


COMMON = [beside_fifth(0.05), calibrated(UR5E, 0.02), calibrated(KUKA, 0.005)]
T_FLANGE_TCP = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.4, 1.0), np.array([0.05, -0.02, 0.12]))


def configurations(arm: Arm, pose: Pose, seed: int) -> Array:
    """Configurations (n, 6) [rad] of a pose by Newton's method from random starts."""
    chain, rng = Chain.of(arm.robot.model), np.random.default_rng(seed)
    q, missed = solved(
        chain,
        rng.uniform(-np.pi, np.pi, (STARTS, 6)),
        flange_pose(pose.T, arm.T_flange_tcp),
        steps=40,
    )
    return np.asarray(wrapped(q[missed < EXACT]))


def posed(arm: Arm, q: Array) -> Pose:
    return Pose(flange(arm.robot, q) @ arm.T_flange_tcp)


def cover(arm: Arm, pose: Pose) -> tuple[Array, Array]:
    problem = Problem(arm=arm, start=np.zeros(6), goal=pose)
    return CoveredPose.of(problem, pose).boxes(SearchLimits(POSE_COVER.rounds))


def within(q: Array, limits_of: Arm) -> Array:
    limits = limits_of.active_limits
    return np.asarray(((q >= limits.q_min) & (q <= limits.q_max)).all(axis=1))


@pytest.mark.parametrize(
    ("tool", "count"), long_but([("tilted", 1)], product(["tilted", "flange"], [1, 6]))
)
def test_every_configuration_is_in_a_box(tool: str, count: int) -> None:
    T = T_FLANGE_TCP.homogeneous if tool == "tilted" else np.eye(4)
    rng = np.random.default_rng(4)
    relations = ("square", "parallel", "square meeting", "oblique", "square")
    robots = [*COMMON, *(robot_of(random_axes(relations, rng)) for _ in range(3))]
    for robot in robots if count > 1 else robots[2:3]:
        # half a turn to either side: one representative per configuration
        limits = replace(robot.limits, q_min=np.full(6, -np.pi), q_max=np.full(6, np.pi))
        arm = Arm(robot=replace(robot, limits=limits), T_flange_tcp=T)
        for k in range(count):
            pose = posed(arm, rng.uniform(-np.pi, np.pi, 6))
            centre, half = cover(arm, pose)
            assert len(centre) <= POSE_COVER.most_boxes
            found = configurations(arm, pose, k)
            assert len(found)
            away = np.abs(wrapped(found[:, None] - centre)) - half
            assert away.max(axis=2).min(axis=1).max() < ROUNDING


def test_united_boxes_hold_all_boxes() -> None:
    rng = np.random.default_rng(6)
    centre, half = rng.normal(size=(300, 6)), rng.uniform(0, 0.1, (300, 6))
    middle, sides = united(centre, half, 20)
    assert len(middle) == 20
    outside = np.abs(centre[:, None] - middle) + half[:, None] - sides
    assert outside.max(axis=2).min(axis=1).max() < ROUNDING
    assert united(centre, half, 300)[0] is centre


def problem_between(robot: Robot, rng: np.random.Generator) -> Problem:
    arm = Arm(robot=robot, T_flange_tcp=T_FLANGE_TCP.homogeneous, collisions=False)
    return Problem(
        arm=arm, start=posed(arm, inside(robot, rng)), goal=posed(arm, inside(robot, rng))
    )


def least_of_pairs(problem: Problem, seed: int) -> float:
    """Least bound of any pair of configurations, with the full turns of least displacement."""
    prepared = PreparedProblem.of(problem)
    poses: Any = (problem.start, problem.goal)
    sides = [configurations(problem.arm, pose, seed) for pose in poses]
    starts, goals = (each[within(each, problem.arm)] for each in sides)
    s, g = (rows.ravel() for rows in np.indices((len(starts), len(goals))))
    starts, goals = starts[s], goals[g]
    turned = nearest_turn(goals, starts)
    goals = np.where(
        (turned >= problem.arm.active_limits.q_min) & (turned <= problem.arm.active_limits.q_max),
        turned,
        goals,
    )
    gain = np.array(
        [prepared.potential(b) - prepared.potential(a) for a, b in zip(starts, goals, strict=True)]
    )
    return float(lower_bounds(prepared, goals - starts, gain)[0].min(initial=np.inf))


def known(prepared: PreparedProblem) -> list[Candidate]:
    return pairs(prepared, ends(prepared, "start")[0], ends(prepared, "goal")[0])


@pytest.mark.long
@pytest.mark.parametrize("robot", COMMON, ids=("beside", "bent", "kuka"))
def test_no_pair_of_configurations_is_below(robot: Robot) -> None:
    rng, ratios = np.random.default_rng(8), list[float]()
    for k in range(10):
        problem = problem_between(robot, rng)
        prepared = PreparedProblem.of(problem)
        assert not all_branches_known(problem)
        both = bound_of_missed_branches(prepared, known(prepared))
        least = least_of_pairs(problem, k)
        assert 0 <= both <= least * (1 + ROUNDING)
        # an arm with a long fall may need no energy at all
        if least > 0:
            ratios.append(both / least)
    assert np.median(ratios) > NEAR


@pytest.mark.long
@pytest.mark.parametrize("robot", long_but([COMMON[0]], COMMON))
def test_a_bound_to_given_joint_positions_is_that_of_the_way_back(robot: Robot) -> None:
    rng = np.random.default_rng(9)
    problem = problem_between(robot, rng)
    q = inside(robot, rng)
    away = replace(problem, start=q)
    gravity = -np.asarray(problem.arm.gravity)
    back = replace(problem, arm=replace(problem.arm, gravity=gravity), start=problem.goal, goal=q)
    found = [
        bound_of_missed_branches(prepared, known(prepared))
        for prepared in map(PreparedProblem.of, (away, back))
    ]
    assert found[0] > 0 and found[1] == pytest.approx(found[0], rel=ROUNDING)
