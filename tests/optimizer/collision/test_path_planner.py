"""State validity against the collision model, and planned paths against distances at dense
samples."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.collision_replay import CollisionReplay
from joulepath import (
    Arm,
    Box,
    HalfSpace,
    NoCollisionFreeTrajectory,
    NoTrajectory,
    Obstacle,
    Problem,
    Scene,
    ToolCone,
    capsule_between,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.joint_path import interpolation_is_free, path_samples
from joulepath.optimizer.collision.planner.path_planner import PLANNER, REGIONS, plan_paths
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths, PlanningEnd
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.path_constraints import PathConstraints, path_constraint_list
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.scene import Shape
from joulepath.optimizer.solve.methods import free_spline, planned_paths
from joulepath.optimizer.solve.methods.free_spline import FREE_SPLINE, FreeSpline
from joulepath.optimizer.solve.methods.planned_paths import PLANNED_PATHS
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import MotionOrigin
from tests.optimizer.cells import LOADS, arm_in_cell, cell
from tests.optimizer.clocks import LAST_READINGS, CountingClock, still
from tests.optimizer.moves import ROBOT, problem_with
from tests.optimizer.placement.cells import at
from tests.selection import long_but

# s: ample, so the seed decides the result, independent of the machine's load
AMPLE = 60.0
# rad: no path leaves the range between start and goal by more
WIDEST = max(region.margin for region in REGIONS)
DENSE = 0.003  # rad between the configurations at which a path is checked
DOWN = Rotation.from_euler("x", np.pi).as_matrix()
REPLAY = 1e-4  # s
FORWARD = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])


def walls(**boxes: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Scene:
    """A table, and boxes by name, size and middle."""
    table: Shape = HalfSpace()
    around = [
        Obstacle(name, Box(np.array(size)), at(*middle), 0.01)
        for name, (size, middle) in boxes.items()
    ]
    return Scene([Obstacle("table", table, at(0, 0, -0.02)), *around])


POST = walls(post=((0.08, 0.08, 0.5), (0.5, 0.0, 0.25)))
SHELF = walls(
    low=((0.3, 0.8, 0.02), (0.7, 0.0, 0.25)),
    high=((0.3, 0.8, 0.02), (0.7, 0.0, 0.60)),
    back=((0.02, 0.8, 0.8), (0.86, 0.0, 0.4)),
)
BIN = walls(
    near=((0.02, 0.4, 0.25), (0.40, 0.3, 0.125)),
    far=((0.02, 0.4, 0.25), (0.75, 0.3, 0.125)),
    left=((0.35, 0.02, 0.25), (0.575, 0.1, 0.125)),
    right=((0.35, 0.02, 0.25), (0.575, 0.5, 0.125)),
)
# open towards the base: the TCP starts inside and has to come back out to get past an arm of the U
TRAP = walls(
    bottom=((0.02, 0.42, 0.5), (0.75, 0.0, 0.25)),
    left=((0.30, 0.02, 0.5), (0.60, 0.2, 0.25)),
    right=((0.30, 0.02, 0.5), (0.60, -0.2, 0.25)),
)


def cage() -> Scene:
    """Twelve bars along the edges of a cube of 0.4 m: the arm reaches in from the other side of
    itself.
    """
    size, thick, middle = 0.4, 0.04, np.array([0.55, 0.0, 0.45])
    bars = {}
    for axis in range(3):
        for k, (first, second) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1))):
            edges, offset = np.full(3, thick), np.zeros(3)
            edges[axis] = size
            offset[[other for other in range(3) if other != axis]] = first, second
            bars[f"bar {axis} {k}"] = (tuple(edges), tuple(middle + size / 2 * offset))
    return walls(**bars)


TASKS = {
    "post": (POST, at(0.5, -0.3, 0.15, DOWN), at(0.5, 0.3, 0.15, DOWN)),
    "shelf": (SHELF, at(0.45, -0.3, 0.12, DOWN), at(0.68, 0.0, 0.42, FORWARD)),
    "bin": (BIN, at(0.55, -0.3, 0.1, DOWN), at(0.575, 0.3, 0.12, DOWN)),
    "trap": (TRAP, at(0.6, 0.0, 0.2, DOWN), at(0.55, 0.4, 0.2, DOWN)),
    "cage": (cage(), at(0.55, 0.5, 0.3, DOWN), at(0.6, 0.0, 0.45, FORWARD)),
}


def task(name: str) -> tuple[Arm, Array, Array]:
    """The arm, and the collision-free start and goal configurations of least displacement."""
    scene, T_start, T_goal = TASKS[name]
    arm = Arm(
        robot=ROBOT,
        scene=scene,
        tool=(capsule_between(np.zeros(3), np.array([0, 0, 0.1]), 0.03),),
        T_flange_tcp=at(0, 0, 0.15),
    )
    kinematics, model = inverse_kinematics_for(arm.robot), CollisionModel(arm)
    ends = []
    for T in (T_start, T_goal):
        found = kinematics.solve(
            T, arm.T_flange_tcp, arm.active_limits, windings=False, target="start"
        )
        ends.append([s.q for s in found if model.signed_distances(s.q[None])[0].min() > 0])
    q_start, q_goal = min(
        ((a, b) for a in ends[0] for b in ends[1]),
        key=lambda both: float(np.abs(both[1] - both[0]).max()),
    )
    return arm, q_start, q_goal


def between(path: Array) -> Array:
    """Waypoints (k, nq) along a path, DENSE apart."""
    parts = [np.linspace(a, b, int(np.abs(b - a).max() / DENSE) + 2) for a, b in pairwise(path)]
    return np.concatenate(parts)


def least(arm: Arm, q: Array) -> float:
    return float(CollisionModel(arm).signed_distances(q, within=0.02)[0].min())


@pytest.mark.parametrize("seed", range(4))
def test_state_validity_agrees_with_the_distances(seed: int) -> None:
    """Boxes, spheres, cylinders, capsules, meshes and half-spaces, margins too."""
    arm = arm_in_cell(LOADS[seed], cell(seed))
    model = CollisionModel(arm)
    limits = arm.active_limits
    q = np.random.default_rng(seed).uniform(limits.q_min, limits.q_max, (400, arm.robot.nq))
    distance = model.signed_distances(q)[0].min(axis=1)
    for reserve in (0.0, 0.005):
        checker = StateValidityChecker(arm, model, reserve)
        valid = np.array([checker.is_valid(x) for x in q])
        # the distances are exact within 1e-8 m
        clear = np.abs(distance - reserve) > 1e-6
        assert (valid == (distance > reserve))[clear].all()
        assert 10 < valid.sum() < 390
        replay = CollisionReplay(arm, model, reserve)
        collides = np.array([replay.collides(x) for x in q])
        # Coal ends its search within 1e-6 m
        clear = np.abs(distance - reserve) > 1e-5
        assert (valid != collides)[clear].all()


@pytest.mark.parametrize("seed", range(4))
def test_a_line_is_valid_if_all_its_states_are(seed: int) -> None:
    """Short lines with few states, and lines along which every pair may come near."""
    arm, rng = arm_in_cell(LOADS[seed], cell(seed)), np.random.default_rng(seed)
    checker = StateValidityChecker(arm, CollisionModel(arm), 0.005)
    limits, ends = arm.active_limits, list[bool]()
    for _ in range(400):
        q = rng.uniform(limits.q_min, limits.q_max)
        if not checker.is_valid(q):
            continue
        count = int(rng.integers(1, 12))
        q_end = q + rng.choice([0.02, 0.3, 3.0]) * rng.uniform(-1.0, 1.0, len(q))
        shares = np.arange(1, count + 1) / count
        states = (1 - shares)[:, None] * q + shares[:, None] * q_end
        is_valid, checked = checker.is_valid_between(q, q_end, count)
        ends.append(all(map(checker.is_valid, states)))
        assert is_valid == ends[-1]
        assert checked == count if is_valid else checked <= count
    assert 10 < sum(ends) < len(ends) - 10


def test_a_line_past_an_obstacle_near_its_beginning_is_invalid() -> None:
    """The tool passes a small box early, and is far from it in the middle and at the end: only the
    levers from the middle on bound how near the box it may have been.
    """
    box = Obstacle("box", Box(np.array([0.03, 0.047, 0.042])), at(-0.227, -0.925, 0.138), 0.005)
    arm = Arm(robot=ROBOT, scene=Scene([box]))
    checker = StateValidityChecker(arm, CollisionModel(arm), 0.0005)
    q = np.array([1.005, 6.175, 0.302, 4.896, 3.232, -5.171])
    q_end = q + np.array([1.109, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert checker.is_valid(q)
    assert not checker.is_valid(q + 5 / 30 * (q_end - q))
    assert not checker.is_valid_between(q, q_end, 30)[0]


def test_a_configuration_without_numbers_is_invalid() -> None:
    arm = arm_in_cell(LOADS[0], cell(0))
    checker = StateValidityChecker(arm, CollisionModel(arm))
    assert not checker.is_valid(np.full(arm.robot.nq, np.nan))


@pytest.mark.parametrize("name", TASKS)
def test_planned_paths_are_collision_free(name: str) -> None:
    arm, q_start, q_goal = task(name)
    limits = arm.active_limits
    # the straight line collides
    assert least(arm, between(np.stack([q_start, q_goal]))) < 0
    paths = plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE)).paths
    assert paths
    for path in paths:
        np.testing.assert_array_equal(path[0], q_start)
        np.testing.assert_array_equal(path[-1], q_goal)
        assert (path >= limits.q_min).all() and (path <= limits.q_max).all()
        assert (path >= np.minimum(q_start, q_goal) - WIDEST).all()
        assert (path <= np.maximum(q_start, q_goal) + WIDEST).all()
        assert least(arm, between(path)) > 0
    lengths = [np.linalg.norm(np.diff(path, axis=0) / limits.v_max, axis=1).sum() for path in paths]
    assert lengths == sorted(lengths)


def test_the_same_seed_gives_the_same_paths() -> None:
    arm, q_start, q_goal = task("post")
    first, again, other = (
        plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE), seed=s).paths for s in (3, 3, 4)
    )
    assert [path.tolist() for path in first] == [path.tolist() for path in again]
    assert [path.tolist() for path in first] != [path.tolist() for path in other]


def test_two_paths_are_distinct() -> None:
    arm, q_start, q_goal = task("post")
    paths = plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE)).paths
    assert len(paths) == 2
    v_max = arm.active_limits.v_max
    assert (
        np.abs(path_samples(paths[0], 1.0, v_max)[0] - path_samples(paths[1], 1.0, v_max)[0]).max()
        > 0.3
    )


def test_a_free_straight_line_is_the_only_path() -> None:
    _, q_start, q_goal = task("post")
    (path,) = plan_paths(Arm(robot=ROBOT), q_start, q_goal, Deadline.after(AMPLE)).paths
    np.testing.assert_array_equal(path, np.stack([q_start, q_goal]))


def test_no_path_to_a_goal_in_collision() -> None:
    arm, q_start, q_goal = task("post")
    through = Scene(
        [
            *arm.scene.obstacles,
            Obstacle("plate", Box(np.array([0.2, 0.2, 0.02])), at(0.5, 0.3, 0.2)),
        ]
    )
    blocked = Arm(robot=ROBOT, scene=through, tool=arm.tool, T_flange_tcp=arm.T_flange_tcp)
    assert plan_paths(blocked, q_start, q_goal, Deadline.after(AMPLE)) == PlannedPaths(
        PlanningEnd.INVALID_END
    )


def walled_in() -> tuple[Arm, Array, Array]:
    """The task of the post, with walls across the whole reach except around the base.

    With the tight limits, the arm cannot fold back enough to pass there.
    """
    arm, q_start, q_goal = task("post")
    wall = Obstacle("wall", Box(np.array([3.0, 0.02, 3.0])), at(1.77, 0.0, 1.0))
    behind = Obstacle("behind", Box(np.array([3.0, 0.02, 3.0])), at(-1.58, 0.0, 1.0))
    over = Obstacle("over", Box(np.array([0.6, 0.02, 2.0])), at(0.0, 0.0, 1.7))
    limits, margin = arm.active_limits, 0.3
    tight = replace(
        limits,
        q_min=np.minimum(q_start, q_goal) - margin,
        q_max=np.maximum(q_start, q_goal) + margin,
    )
    closed = replace(arm, scene=Scene([*arm.scene.obstacles, wall, behind, over]), limits=tight)
    return closed, q_start, q_goal


def test_no_path_to_a_walled_in_goal_and_an_answer_by_the_deadline() -> None:
    closed, q_start, q_goal = walled_in()
    assert least(closed, q_start[None]) > 0 and least(closed, q_goal[None]) > 0
    clock, readings = CountingClock(), 30
    found = plan_paths(closed, q_start, q_goal, Deadline.after(readings, clock))
    assert found.end is PlanningEnd.CUT_SHORT and not found.paths
    assert readings < clock.now < readings + LAST_READINGS


def problem(arm: Arm, q_start: Array, q_goal: Array) -> Problem:
    given = {
        "robot": arm.robot,
        "scene": arm.scene,
        "tool": arm.tool,
        "T_flange_tcp": arm.T_flange_tcp,
        "limits": arm.limits,
    }
    return problem_with(q_start, q_goal, windings=False, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", long_but(("shelf",), TASKS))
def test_motions_avoid_the_obstacles(name: str) -> None:
    arm, q_start, q_goal = task(name)
    found = optimize(problem(arm, q_start, q_goal))
    q = sample(found.trajectory.spline, np.arange(0.0, found.duration, REPLAY))[0]
    assert least(arm, q) >= 0


@pytest.mark.parametrize(
    ("incumbent_cost", "was_postponed", "planned"),
    [(np.inf, False, False), (1e6, False, True), (np.inf, True, True)],
)
def test_a_motion_deep_inside_an_obstacle_is_left_for_a_planned_path_once_one_is_known(
    incumbent_cost: float, was_postponed: bool, planned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a costly escape is compared with planned paths, too
    monkeypatch.setattr(free_spline, "FREE_SPLINE", replace(FREE_SPLINE, detour_cost=np.inf))
    arm, q_start, q_goal = task("post")
    # the optimiser alone finds a way out with the capsules of the links
    arm = replace(arm, robot=replace(arm.robot, hulls=()))
    prepared = PreparedProblem.of(problem(arm, q_start, q_goal))
    context = replace(
        SolveContext.of(prepared, q_start, q_goal, NEVER),
        incumbent_cost=incumbent_cost,
        was_postponed=was_postponed,
    )
    found = FreeSpline(context).solve()
    assert found.spline is not None
    assert (found.origin is MotionOrigin.FROM_PLANNED_PATH) == planned


def test_a_request_among_obstacles_has_the_same_answer_whatever_time_it_takes() -> None:
    """The clock stands still, or ticks at each reading as on a busy machine: both stay far from the
    deadline.
    """
    asked = problem(*task("cage"))
    calm, busy = optimize(asked, clock=still), optimize(asked, clock=CountingClock(tick=1e-4))
    # the optimiser alone finds no way between the bars
    assert calm.candidates[0].reason == f"converged{MotionOrigin.FROM_PLANNED_PATH.value}"
    np.testing.assert_array_equal(
        calm.trajectory.spline.control_points, busy.trajectory.spline.control_points
    )


def test_a_failed_candidate_says_whether_the_deadline_ended_the_planning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = problem(*walled_in())
    limited = replace(PLANNED_PATHS, most_states=2_000)
    monkeypatch.setattr(planned_paths, "PLANNED_PATHS", limited)
    with pytest.raises(NoTrajectory) as exhausted:
        optimize(asked, clock=still)
    (candidate,) = exhausted.value.candidates
    assert candidate.status == "failed" and "found no path in" in candidate.reason
    assert isinstance(exhausted.value, NoCollisionFreeTrajectory) and not exhausted.value.cut_short
    monkeypatch.undo()
    # some thousand readings, too few for all states
    with pytest.raises(NoTrajectory) as cut_short:
        optimize(replace(asked, deadline=10.0), clock=CountingClock(tick=2e-3))
    (candidate,) = cut_short.value.candidates
    assert (
        candidate.status == "failed" and "the deadline ended the path planner" in candidate.reason
    )
    assert isinstance(cut_short.value, NoCollisionFreeTrajectory) and cut_short.value.cut_short
    assert "allow a longer deadline" in str(cut_short.value)


@pytest.mark.parametrize("states", long_but((2_000,), (2_000, PLANNED_PATHS.most_states)))
def test_a_failed_candidate_names_the_colliding_bodies(
    states: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    limited = replace(PLANNED_PATHS, most_states=states)
    monkeypatch.setattr(planned_paths, "PLANNED_PATHS", limited)
    with pytest.raises(NoTrajectory) as raised:
        optimize(problem(*walled_in()))
    (candidate,) = raised.value.candidates
    assert candidate.status == "failed"
    assert any(name in candidate.reason for name in ("wall", "post", "over"))


def test_interpolation_between_paths_on_two_sides_of_an_obstacle_collides() -> None:
    arm, q_start, q_goal = task("post")
    model, ones = CollisionModel(arm), np.ones(6)
    (path, *_) = plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE)).paths
    around = path_samples(path, 1.0, ones)[0]
    through = path_samples(np.stack([q_start, q_goal]), 1.0, ones)[0]
    assert interpolation_is_free(model, around, around)
    assert not interpolation_is_free(model, around, 2 * through - around)


def test_limits_tightened_are_kept() -> None:
    arm, q_start, q_goal = task("post")
    limits = arm.active_limits
    margin = 0.5
    tight = replace(
        limits,
        q_min=np.maximum(limits.q_min, np.minimum(q_start, q_goal) - margin),
        q_max=np.minimum(limits.q_max, np.maximum(q_start, q_goal) + margin),
    )
    for path in plan_paths(
        replace(arm, limits=tight), q_start, q_goal, Deadline.after(AMPLE)
    ).paths:
        assert (path >= tight.q_min).all() and (path <= tight.q_max).all()


def test_planned_paths_keep_the_tool_within_its_cone() -> None:
    arm, q_start, q_goal = task("post")
    cone = ToolCone(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), 0.4)
    held = replace(arm, tool_cone=cone)
    tilt = PathConstraints(joint_placements(arm.robot.model), path_constraint_list(held))

    def widest(paths: list[Array]) -> float:
        return max(float(tilt.ratios(q := between(path), np.zeros_like(q)).max()) for path in paths)

    free, within = (
        plan_paths(a, q_start, q_goal, Deadline.after(AMPLE)).paths for a in (arm, held)
    )
    assert within
    assert widest(within) <= 1 + PLANNER.step / cone.half_angle
    assert widest(free) > 1.2


def test_samples_along_a_path_rest_at_its_ends_and_round_its_corners() -> None:
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]])
    q, t = path_samples(path, 3.0, np.array([1.0, 1.0]))
    assert t[0] == 0 and t[-1] == 3
    np.testing.assert_array_equal(q[[0, -1]], path[[0, -1]])
    v = np.gradient(q, t, axis=0)
    a = np.gradient(v, t, axis=0)
    # the quintic law's v and a grow with t² and t: by 30 l t²/T³ and 60 l t/T³ at the second sample
    assert np.abs(v[[0, -1]]).max() < 1e-2 and np.abs(a[[0, -1]]).max() < 0.3
    # the cut at the corner is smaller than the rounding radius: 6 % of a length of 3
    corner = np.linalg.norm(q - path[1], axis=1).min()
    assert 0.01 < corner < 0.06 * 3
    assert (np.diff(q, axis=0) >= -1e-12).all()
