"""Paths with free rotation of the tool about an axis: saved energy and certificate."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import Arm, BranchFilter, PathInfeasible, Pose, Problem, Solution, ToolPath, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.kinematics.tcp import tcp_pose as pose_of
from joulepath.optimizer.kinematics.tool_path.course_tracing import chain_of
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.kinematics.tool_path.turning_grid import TurningGrid, shortest
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import AMPLE, ROBOT
from tests.optimizer.tool_paths import HOME, along, moved
from tests.refusals import refusal_of
from tests.selection import long_but

Z = (0.0, 0.0, 1.0)
# a nozzle offset from the flange: turning it about its own axis moves the wrist
NOZZLE = Pose.from_rotation([0.15, 0.0, 0.1], np.eye(3)).T
ARM = Arm(robot=ROBOT, T_flange_tcp=NOZZLE, collisions=False)


def down(x: float, y: float, z: float) -> Pose:
    return Pose.from_quaternion([x, y, z], [0.0, 1.0, 0.0, 0.0])


def over_the_base(**given: Any) -> Problem:
    """A line over the first axis, out of reach of a wrist above the TCP."""
    path = given.pop("path", ToolPath(about=Z))
    task = {
        "arm": ARM,
        "start": down(0.45, -0.12, 0.25),
        "goal": down(-0.45, 0.12, 0.25),
        "tool_path": path,
    }
    return Problem(
        **{**task, "branch": BranchFilter("left", "down", "flip"), "deadline": AMPLE} | given
    )


@pytest.fixture(scope="module")
def crossed() -> Solution:
    return optimize(over_the_base())


def axes_and_positions(found: Solution, arm: Arm) -> tuple[Array, Array]:
    spline = found.trajectory.spline
    T = pose_of(arm, spline.curve(np.linspace(0.0, spline.duration, 3000)))
    return T[:, :3, 2], T[:, :3, 3]


@pytest.mark.long
def test_a_tool_that_may_turn_follows_what_no_other_can(crossed: Solution) -> None:
    with pytest.raises(PathInfeasible):
        optimize(over_the_base(path=ToolPath()))
    assert crossed.certificate.valid and crossed.lower_bound <= crossed.energy.electrical.total
    axis, position = axes_and_positions(crossed, ARM)
    start, way = np.array([0.45, -0.12, 0.25]), np.array([-0.9, 0.24, 0.0])
    share = (position - start) @ way / (way @ way)
    assert (
        np.linalg.norm(position - start - share[:, None] * way, axis=1).max()
        < ToolPath().position_tolerance
    )
    assert (
        np.linalg.norm(axis[:, :2], axis=1).max() < ToolPath().rotation_tolerance
        and (np.diff(share) > -1e-6).all()
    )
    for error in (crossed.certificate.start_error, crossed.certificate.goal_error):
        assert max(error) < 1e-6, "at its ends the tool has its full pose"


@pytest.mark.long
def test_the_certificate_allows_turns_about_this_axis_alone(crossed: Solution) -> None:
    ratios = {}
    for about in (None, Z, (1.0, 0.0, 0.0), (0.02, 0.0, 1.0)):
        asked = over_the_base(path=ToolPath(about=about))
        ends = crossed.start.q, crossed.goal.q
        ratios[about] = certify(
            asked, crossed.trajectory.spline, *ends, crossed.energy
        ).worst_ratio["path_rotation"]
    assert ratios.pop(Z) <= 1
    assert all(ratio > 10 for ratio in ratios.values())


@pytest.mark.parametrize("seed", long_but(range(1), range(30)))
def test_it_never_needs_more_than_without_turns(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3))
    goal, via = moved(rng.uniform(-0.25, 0.25, 3), turn), moved(rng.uniform(-0.2, 0.2, 3))
    path = ToolPath(via=[via], blend=0.02)
    try:
        fixed = optimize(along(goal, path=path))
    except PathInfeasible:
        return
    free = optimize(along(goal, path=replace(path, about=Z)))
    assert free.certificate.valid
    assert free.energy.electrical.total <= fixed.energy.electrical.total * (1 + 1e-6)


def test_a_turning_is_the_shortest_of_all_on_its_sheet() -> None:
    """Brute force over short turnings is the reference; every step of the path is a step of the
    sheet.
    """
    problem = along(moved([0.0, 0.2, 0.0]), path=ToolPath(about=Z))
    course = PreparedProblem.of(problem).course
    assert course is not None
    sheet = TurningGrid.of(problem.arm, chain_of(ROBOT), course, HOME, steps=5, most=0.5)
    poses = course.poses(sheet.at)
    for k, at in enumerate(poses):
        T = pose_of(problem.arm, sheet.q[k])
        assert np.abs(T[:, :3, 3] - at[:3, 3]).max() < 1e-8
        turned = Rotation.from_matrix(at[:3, :3].T @ T[:, :3, :3]).as_rotvec()
        assert np.abs(turned - np.outer(sheet.angles, Z)).max() < 1e-8

    rng, middle = np.random.default_rng(0), len(sheet.angles) // 2
    drawn = rng.uniform(0.5, 1.5, (4, len(sheet.angles)))

    def cost(first: Array, second: Array, k: Any) -> Array:
        """The path length in joint space, times a factor of the point at the start of a step."""
        begins = np.abs(sheet.q[k, :, 5] - first[:, None, 5]).argmin(axis=1)
        return shortest(first, second, k) * drawn[k, begins]

    def total(chosen: Array) -> float:
        rows = sheet.q[np.arange(5), chosen]
        return float(cost(rows[:-1], rows[1:], np.arange(4)).sum())

    best = sheet.least(cost)
    assert best is not None and best[0] == best[-1] == middle
    turnings = (middle + np.array([0, a - 3, b - 3, c - 3, 0]) for a, b, c in np.ndindex(7, 7, 7))
    assert (
        total(best)
        <= min(total(each) for each in turnings if np.abs(np.diff(each)).max() <= 3) + 1e-12
    )


@pytest.mark.parametrize("about", [(0.0, 0.0, 0.0), (np.nan, 0.0, 1.0), (1.0, 0.0)])
def test_a_wrong_axis_is_refused(about: Any) -> None:
    with refusal_of("path.tolerance.about"):
        ToolPath(about=about)


def test_a_deviation_counts_the_direction_of_the_axis() -> None:
    course = ToolCourse.of(ToolPath(about=Z), moved([0, 0, 0]).T, moved([0.0, 0.2, 0.0]).T)
    T = course.poses(np.linspace(0.0, 1.0, 200))
    spun, tilted = T.copy(), T.copy()
    spun[:, :3, :3] @= Rotation.from_rotvec(np.outer(np.linspace(0.0, 5.0, 200), Z)).as_matrix()
    tilted[:, :3, :3] @= Rotation.from_rotvec([0.01, 0.0, 0.0]).as_matrix()
    assert max(each.max() for each in course.deviation(spun)) < 1e-6
    assert course.deviation(tilted)[1].max() == pytest.approx(0.01, rel=1e-3)
