"""Paths with a free rotation of the tool about an axis at the start or goal: saved energy, bound,
and refusals.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    Arm,
    BranchFilter,
    ConeOrientedPose,
    InvalidProblem,
    JoulepathError,
    PathInfeasible,
    Pose,
    Problem,
    Solution,
    ToolPath,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.free_ends_bound import bound_between_free_ends
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.kinematics.orientation_tolerance import excess_angle, nearest_orientation
from joulepath.optimizer.kinematics.tcp import tcp_pose as pose_of
from joulepath.optimizer.kinematics.tool_path.course_tracing import chain_of
from joulepath.optimizer.kinematics.tool_path.turning_grid import (
    TurningGrid,
    shortest,
    turning_through,
)
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import bound, pairs
from joulepath.optimizer.search.ends import SampleCounts, ends_of
from joulepath.optimizer.search.path_ends import bound_beside, path_candidates
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.end_angle import try_angles
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.optimizer.test_turning_path import ARM, Z, down, over_the_base
from tests.optimizer.tool_paths import HOME, along, moved
from tests.refusals import refusal_of
from tests.selection import long_but


def free(pose: Pose) -> ConeOrientedPose:
    return ConeOrientedPose.about(pose, np.array(Z))


def turned_as_little_as_may_be(goal: Pose, before: Pose) -> Pose:
    return free(goal).with_orientation(nearest_orientation(free(goal), before.T[:3, :3]))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(20))
def test_a_free_end_never_needs_more_than_the_one_without_a_turn(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, 3))
    goal, via = moved(rng.uniform(-0.2, 0.2, 3), turn), moved(rng.uniform(-0.2, 0.2, 3))
    path = ToolPath(via=[via] if seed % 2 else [], blend=0.02 * (seed % 2), about=Z)
    fixed = turned_as_little_as_may_be(goal, via if seed % 2 else tcp_pose(HOME))
    try:
        pinned = optimize(along(fixed, path=path))
    except PathInfeasible:
        return
    found = optimize(along(free(goal), path=path))
    assert found.certificate.valid
    assert found.energy.electrical.total <= pinned.energy.electrical.total * (1 + 1e-6)
    assert found.lower_bound <= pinned.lower_bound * (1 + 1e-9), "there are more motions"
    q = found.trajectory.spline.curve(np.linspace(0.0, found.trajectory.spline.duration, 2000))
    T = pose_of(along(goal, path=path).arm, q)
    assert excess_angle(free(goal), T[-1, :3, :3]) < 1e-6
    if not seed % 2:
        start, way = T[0, :3, 3], T[-1, :3, 3] - T[0, :3, 3]
        off = T[:, :3, 3] - start - np.outer((T[:, :3, 3] - start) @ way / (way @ way), way)
        assert np.linalg.norm(off, axis=1).max() < path.position_tolerance


@pytest.mark.long
@pytest.mark.parametrize("start", long_but(["joint positions"], ["joint positions", "pose"]))
def test_no_motion_to_any_angle_at_the_goal_needs_less_than_the_bound(start: str) -> None:
    rng, goal = np.random.default_rng(3), moved([0.1, 0.15, -0.1])
    given = HOME if start == "joint positions" else tcp_pose(HOME)
    asked = along(free(goal), start=given, path=ToolPath(about=Z))
    bound = optimize(asked).lower_bound
    assert bound > 0
    reached = 0
    for angle in rng.uniform(-np.pi, np.pi, 8):
        T = goal.T.copy()
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
        try:
            anywhere = optimize(replace(asked, goal=Pose(T), tool_path=None))
        except JoulepathError:
            continue
        reached += 1
        assert anywhere.energy.electrical.total >= bound
    assert reached > 4


def test_a_turning_to_a_free_end_is_the_shortest_on_its_sheet() -> None:
    problem = along(moved([0.0, 0.2, 0.0]), path=ToolPath(about=Z))
    course = PreparedProblem.of(problem).course
    assert course is not None
    sheet = TurningGrid.of(problem.arm, chain_of(ROBOT), course, HOME, steps=4, most=0.5)
    middle = len(sheet.angles) // 2

    def total(chosen: Array) -> float:
        rows = sheet.q[np.arange(4), chosen]
        return float(shortest(rows[:-1], rows[1:], np.arange(3)).sum())

    best, pinned = sheet.least(shortest, free_end=True), sheet.least(shortest)
    assert best is not None and pinned is not None and best[0] == middle
    steps = np.array(list(np.ndindex(7, 7, 7))) - 3
    all_turnings = middle + np.concatenate(
        [np.zeros((len(steps), 1), dtype=int), steps.cumsum(axis=1)], axis=1
    )
    least = min(total(each) for each in all_turnings)
    assert total(best) == pytest.approx(least, rel=1e-12) and total(best) <= total(pinned)


def test_a_smooth_turning_may_be_an_even_one_to_a_free_end() -> None:
    at = np.linspace(0.0, 1.0, 30)
    even, pinned = (turning_through(at, 0.7 * at, 10, free_end) for free_end in (True, False))
    assert np.abs(even(at) - 0.7 * at).max() < 1e-12
    assert abs(pinned(1.0)) < 1e-12 and abs(pinned(0.0)) < 1e-12


@pytest.mark.parametrize("known", [True, False], ids=["a motion at zero", "none at zero"])
@pytest.mark.parametrize("least", [-3.0, -1.1, 0.4, 2.9])
def test_the_best_angle_is_found_all_around(least: float, known: bool) -> None:
    asked: dict[float, float] = {}

    def cost(angle: float) -> float:
        asked[angle] = np.inf if 1 < angle < 1.6 else 5.0 - np.cos(angle - least)
        return asked[angle]

    try_angles(cost, cost(0.0) if known else np.inf)
    assert min(asked.values()) < 4.001 and len(asked) < 20


def test_without_any_motion_the_angles_all_around_are_enough() -> None:
    asked = list[float]()

    def cost(angle: float) -> float:
        asked.append(angle)
        return np.inf

    try_angles(cost, np.inf)
    assert len(asked) == 7


WRONG: list[tuple[Any, ToolPath]] = [
    (free(down(0.4, 0.1, 0.2)), ToolPath()),
    (free(down(0.4, 0.1, 0.2)), ToolPath(about=(1.0, 0.0, 0.0))),
    (ConeOrientedPose(np.array([0.4, 0.1, 0.2])), ToolPath(about=Z)),
    (
        ConeOrientedPose(
            np.array([0.4, 0.1, 0.2]), direction=np.array([0.0, 0.0, -1.0]), half_angle=0.1
        ),
        ToolPath(about=Z),
    ),
]


@pytest.mark.parametrize(("goal", "path"), WRONG)
def test_any_other_freedom_of_the_goal_is_refused(goal: Any, path: ToolPath) -> None:
    with refusal_of("goal.pose.orientation"):
        Problem(arm=Arm(robot=ROBOT), start=HOME, goal=goal, tool_path=path)


def test_the_opposite_axis_is_the_same_freedom() -> None:
    goal = ConeOrientedPose(
        down(0.4, 0.1, 0.2).T[:3, 3], -np.array(Z), np.array([0.0, 0.0, 1.0]), 0.0
    )
    Problem(arm=Arm(robot=ROBOT), start=HOME, goal=goal, tool_path=ToolPath(about=Z))


FAR_AWAY = down(0.8, -0.12, 0.25)


def inwards(start: Any) -> Problem:
    """A line towards the base; at its end, a nozzle points back at the base."""
    goal = down(0.45, -0.12, 0.25)
    return over_the_base(start=start, goal=goal, branch=BranchFilter("right", "up", "flip"))


@pytest.fixture(scope="module")
def retracted() -> Solution:
    return optimize(inwards(free(FAR_AWAY)))


@pytest.mark.long
def test_a_known_motion_from_a_free_start_is_certified_as_it_is(retracted: Solution) -> None:
    """The second run starts without the path's start chosen by the first run."""
    again = Run(inwards(free(FAR_AWAY))).as_it_is(retracted.trajectory.spline)
    assert again.certificate.valid
    assert again.energy.electrical.total == pytest.approx(
        retracted.energy.electrical.total, rel=1e-12
    )
    assert {each.name for each in again.baselines} == {each.name for each in retracted.baselines}


def ends_turned(seed: int) -> tuple[Pose, Pose]:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, 3))
    return tcp_pose(HOME), moved(rng.uniform(-0.2, 0.2, 3), turn)


@pytest.mark.long
@pytest.mark.parametrize("both", [False, True], ids=["start", "both"])
@pytest.mark.parametrize("seed", range(10))
def test_a_free_start_is_no_worse_than_a_given_one(seed: int, both: bool) -> None:
    start, goal = ends_turned(seed)
    given = along(goal, start=start, path=ToolPath(about=Z))
    try:
        pinned = optimize(given)
    except PathInfeasible:
        return
    found = optimize(replace(given, start=free(start), goal=free(goal) if both else goal))
    assert found.certificate.valid
    assert found.energy.electrical.total <= pinned.energy.electrical.total * (1 + 2e-3)
    assert found.lower_bound <= pinned.lower_bound * (1 + 1e-9), "there are more motions"


@pytest.mark.long
@pytest.mark.parametrize("both", [False, True], ids=lambda both: "both" if both else "start")
def test_no_motion_from_any_angle_at_the_start_needs_less_than_the_bound(both: bool) -> None:
    rng, (start, goal) = np.random.default_rng(3), ends_turned(2)
    asked = along(free(goal) if both else goal, start=free(start), path=ToolPath(about=Z))
    bound = optimize(asked).lower_bound
    assert bound > 0
    reached = 0
    for first, last in rng.uniform(-np.pi, np.pi, (4, 2)):
        turned = partial(_turned, start, first), partial(_turned, goal, last if both else 0.0)
        try:
            anywhere = optimize(replace(asked, start=turned[0](), goal=turned[1](), tool_path=None))
        except JoulepathError:
            continue
        reached += 1
        assert anywhere.energy.electrical.total >= bound
    assert reached > 1


def _turned(pose: Pose, angle: float) -> Pose:
    T = pose.T.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    return Pose(T)


@pytest.mark.parametrize("seed", long_but([0], range(6)))
def test_the_bound_between_free_ends_is_that_of_the_best_pair_but_for_little(seed: int) -> None:
    start, goal = ends_turned(seed)
    asked = PreparedProblem.of(along(free(goal), start=HOME, tool_path=None))
    proven = bound_between_free_ends(asked, free(start), free(goal), NEVER, np.inf)
    counts = SampleCounts(orientations=72, turns=18, members=4)
    starts, goals = (ends_of(asked, "goal", free(end), counts)[0] for end in (start, goal))
    known = pairs(asked, starts, goals)
    bound(asked, known)
    least = min(each.lower_bound for each in known)
    assert 0.9 * least < proven <= least


def test_a_path_is_followed_from_angles_all_around() -> None:
    start, goal = ends_turned(0)
    found = path_candidates(
        PreparedProblem.of(along(goal, start=free(start), path=ToolPath(about=Z)))
    )
    labels = {each.start.label for each in found}
    assert len(found) >= 8 * len(labels) and all(each.deferred for each in found)


@pytest.mark.long
@pytest.mark.parametrize("both", long_but([True], [False, True]))
def test_the_bound_beside_is_that_of_a_problem_without_the_path(both: bool) -> None:
    """Without the path, no problem has a free start: the bound needs another one."""
    start, goal = ends_turned(0)
    asked = along(free(goal) if both else goal, start=free(start), path=ToolPath(about=Z))
    prepared = PreparedProblem.of(asked)
    beside = bound_beside(prepared, path_candidates(prepared), NEVER, enough=1.0)
    assert 1.0 <= beside < np.inf


@pytest.mark.parametrize(("start", "path"), WRONG)
def test_any_other_freedom_of_the_start_is_refused(start: Any, path: ToolPath) -> None:
    with refusal_of("start.pose.orientation"):
        Problem(arm=ARM, start=start, goal=down(0.45, -0.12, 0.25), tool_path=path)


def test_without_a_path_the_start_has_its_orientation() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        Problem(arm=ARM, start=free(FAR_AWAY), goal=HOME, deadline=AMPLE)
    assert refusal.value.field == "start" and "path" in str(refusal.value)
