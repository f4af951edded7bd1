"""Cycles with a partly free tool orientation at stops and at ends of paths."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    Arm,
    BranchFilter,
    ConeOrientedPose,
    Cycle,
    CycleSolution,
    DeadlineExceeded,
    InvalidProblem,
    Line,
    Pose,
    Stop,
    StopPath,
    ToolPath,
    UnreachablePose,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.cycle import free_orientations, stop_layers, tool_turns
from tests.optimizer.clocks import CountingClock
from tests.optimizer.cycle.cycles import HOME
from tests.optimizer.cycle.test_optimize_cycle import assert_true, planned
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.selection import long_but

# a nozzle beside the flange: turning it moves the wrist
NOZZLE = Arm(
    robot=ROBOT, collisions=False, T_flange_tcp=Pose.from_quaternion([0.15, 0, 0.1], [0, 0, 0, 1]).T
)
DOWN = np.array([0.0, 0.0, -1.0])
AXIS = np.array([0.0, 0.0, 1.0])
TURNING = ToolPath(about=(0.0, 0.0, 1.0))
FROM = (0.7, -0.2, 0.2)  # ends of the seam in the base frame [m]
TO = (0.7, 0.2, 0.2)
# m, and of unit vectors: the tolerances of a path
NEAR = 2e-3
# certification after the deadline, as a share of the deadline
OVERRUN = 0.1
TILT = 0.3  # half angle of the cone at a stop [rad]
ON_MANIFOLD = 1e-8  # largest error of a configuration at its pose [m, rad]
EXACT = 1e-9  # rounding of joint positions [rad]
# relative advantage of a cycle at given orientations over the answer, which is a local optimum
CHOSEN = 1e-3
# s: less than any motion takes
FAR_TOO_SHORT = 1e-3


def down(at: tuple[float, float, float]) -> Pose:
    return Pose.from_quaternion(at, [0.0, 1.0, 0.0, 0.0])


def free(at: tuple[float, float, float], axis: Array = AXIS) -> ConeOrientedPose:
    return ConeOrientedPose.about(down(at), axis)


def seam(start: Any, goal: Any, **path: Any) -> Cycle:
    """A seam in one branch, and back to the start."""
    way = StopPath(**{"goal": goal, "path": TURNING, "speed": 0.3} | path)
    branch = BranchFilter(shoulder="right", elbow="up", wrist="flip")
    stop = Stop(name="seam", target=start, path=way, branch=branch)
    return Cycle(arm=NOZZLE, start=HOME, stops=[stop], windings=False, closed=False, deadline=AMPLE)


@pytest.fixture
def few_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer angles than in a request, since every angle means one more path to solve."""
    turns = replace(tool_turns.TOOL_TURNS, angles=(0.0, 2.0), orientations=4)
    monkeypatch.setattr(tool_turns, "TOOL_TURNS", turns)
    settings = replace(free_orientations.FREE_ORIENTATIONS, steps_on_paths=(0.3,), steps=(0.3, 0.1))
    monkeypatch.setattr(free_orientations, "FREE_ORIENTATIONS", settings)


@pytest.mark.long
@pytest.mark.usefixtures("few_angles")
@pytest.mark.parametrize(
    ("free_start", "free_goal"),
    long_but([(False, True)], [(False, True), (True, False), (True, True)]),
)
def test_the_angles_are_chosen_for_the_whole_cycle(free_start: bool, free_goal: bool) -> None:
    start, goal = free(FROM) if free_start else down(FROM), free(TO) if free_goal else down(TO)
    asked, given = seam(start, goal), plan_cycle(seam(down(FROM), down(TO)))
    found = planned(asked)
    assert found.status == "feasible"
    # a bound over all angles holds for these, too
    assert 0 < found.lower_bound <= given.energy.electrical.total
    path = found.moves[1]
    assert path.planned.kind == "path" and (
        path.solution.start.target,
        path.solution.goal.target,
    ) == (0, 0)
    turned = []
    for end, at, pose in ((path.solution.start, FROM, start), (path.solution.goal, TO, goal)):
        T = tcp_pose(end.q, NOZZLE.T_flange_tcp).T
        assert np.abs(T[:3, 3] - at).max() < NEAR and np.abs(T[:3, 2] - DOWN).max() < NEAR
        turned.append(np.abs(T[:3, :3] - down(at).T[:3, :3]).max() > NEAR)
        assert turned[-1] <= isinstance(pose, ConeOrientedPose)
    assert any(turned)
    assert found.energy.electrical.total < given.energy.electrical.total


@pytest.mark.usefixtures("few_angles")
@pytest.mark.parametrize("readings", long_but([300], [30, 300, 1000, 3000, 10_000]))
def test_a_deadline_gives_a_cycle_or_says_so(readings: int) -> None:
    asked = replace(seam(down(FROM), free(TO)), deadline=float(readings))
    try:
        found = plan_cycle(asked, clock=CountingClock())
    except DeadlineExceeded:
        return
    assert_true(asked, found)
    assert found.wall_time <= readings * (1 + OVERRUN)


def test_a_start_out_of_reach_at_every_angle_is_one_pose() -> None:
    with pytest.raises(UnreachablePose) as refusal:
        plan_cycle(seam(free((1.7, -0.2, 0.2)), free((1.7, 0.2, 0.2))))
    assert refusal.value.target == "stops/seam/entry" and "orientations" in str(refusal.value)


@pytest.mark.parametrize(
    ("start", "goal", "path", "field", "word"),
    [
        (free(FROM), free(TO), {"path": ToolPath()}, "stops.0.path.points.0.orientation", "about"),
        (
            down(FROM),
            free(TO, np.array([1.0, 0, 0])),
            {},
            "stops.0.path.points.1.orientation",
            "same axis",
        ),
        (
            ConeOrientedPose(np.array(FROM)),
            down(TO),
            {},
            "stops.0.path.points.0.orientation",
            "in full",
        ),
        (free(FROM), down(TO), {"split": True}, "stops.0.path.points.0.orientation", "split"),
    ],
)
def test_an_end_that_is_free_otherwise_names_its_field(
    start: Any, goal: Any, path: dict[str, Any], field: str, word: str
) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        seam(start, goal, **path)
    assert refusal.value.field == field and word in str(refusal.value)


def free_stops(**changes: Any) -> Cycle:
    """A part with any grip angle, put down with a slightly tilted tool."""
    pick = Stop(name="pick", target=ConeOrientedPose.about(down((0.5, -0.2, 0.1)), AXIS), dwell=0.2)
    cone = ConeOrientedPose(np.array([0.3, 0.4, 0.3]), AXIS, DOWN, TILT)
    place = Stop(name="place", target=cone, branch=BranchFilter(shoulder="right"))
    asked = Cycle(
        arm=Arm(robot=ROBOT, collisions=False),
        start=HOME,
        stops=[pick, place],
        windings=False,
        deadline=AMPLE,
    )
    return replace(asked, **changes)


def assert_reached(found: CycleSolution, arm: Arm, name: str, at: Any, tilt: float = 0.0) -> None:
    """Check for a stop with the tool in place and its axis within a cone about straight down."""
    (goal,) = [move.solution.goal for move in found.moves if move.planned.goal == name]
    T = tcp_pose(goal.q, arm.T_flange_tcp).T
    assert goal.target == 0
    assert (
        np.abs(T[:3, 3] - at).max() < ON_MANIFOLD and T[:3, 2] @ DOWN >= np.cos(tilt) - ON_MANIFOLD
    )


@pytest.mark.long
@pytest.mark.usefixtures("few_angles")
@pytest.mark.parametrize("windings", [False, True])
def test_orientations_at_stops_are_chosen_for_the_whole_cycle(windings: bool) -> None:
    asked = free_stops(windings=windings)
    found = planned(asked)
    assert found.status == "feasible" and found.complete
    assert_reached(found, asked.arm, "pick", (0.5, -0.2, 0.1))
    assert_reached(found, asked.arm, "place", (0.3, 0.4, 0.3), TILT)
    # attack by cycles at given orientations: none is below the bound or clearly below the answer
    rng = np.random.default_rng(3)
    for _ in range(2):
        turns = rng.uniform([-np.pi, -TILT / 2, -TILT / 2], [np.pi, TILT / 2, TILT / 2])
        pick, place = (
            Pose.from_rotation(
                at, down((0, 0, 0)).T[:3, :3] @ Rotation.from_rotvec(turn).as_matrix()
            )
            for at, turn in (
                ((0.5, -0.2, 0.1), [0, 0, turns[0]]),
                ((0.3, 0.4, 0.3), [*turns[1:], turns[0]]),
            )
        )
        stops = [replace(asked.stops[0], target=pick), replace(asked.stops[1], target=place)]
        given = plan_cycle(replace(asked, stops=stops))
        assert found.lower_bound <= given.energy.electrical.total
        assert found.energy.electrical.total <= given.energy.electrical.total * (1 + CHOSEN)


@pytest.mark.long
@pytest.mark.usefixtures("few_angles")
def test_a_free_stop_has_lines_and_is_passed() -> None:
    """A free stop may have lines, and the arm may pass a free stop.

    Lines along the free axis keep the kind of pose at the outer end.
    """
    asked = free_stops(closed=False)
    lift = Line(direction=np.array([0.0, 0.0, 1.0]), distance=0.05)
    passed = Stop(
        name="over", target=ConeOrientedPose.about(down((0.45, 0.1, 0.35)), AXIS), via=True
    )
    stops = [
        replace(asked.stops[0], approach=lift),
        passed,
        replace(asked.stops[1], target=down((0.3, 0.4, 0.3))),
    ]
    asked = replace(asked, stops=stops)
    found = plan_cycle(asked)
    assert found.joins < EXACT and all(move.solution.certificate.valid for move in found.moves)
    assert 0 < found.lower_bound <= found.energy.electrical.total
    assert_reached(found, asked.arm, "pick/approach", (0.5, -0.2, 0.15))
    assert_reached(found, asked.arm, "pick", (0.5, -0.2, 0.1))
    (on_way,) = found.moves[-1].passes
    T = tcp_pose(on_way.q, asked.arm.T_flange_tcp).T
    assert np.abs(T[:3, 3] - (0.45, 0.1, 0.35)).max() < ON_MANIFOLD and on_way.target == 0


def test_the_poses_at_the_end_of_a_line_are_known_where_they_are_one() -> None:
    pose = ConeOrientedPose.about(down((0.5, -0.2, 0.1)), AXIS)
    up, across = np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0])
    above = stop_layers._shifted_pose(pose, Line(direction=up, distance=0.05), -1.0)
    assert (
        above is not None
        and above.position == pytest.approx([0.5, -0.2, 0.15])
        and (above.axis == pose.axis).all()
    )
    beside = stop_layers._shifted_pose(
        pose, Line(direction=across, distance=0.05, frame="base"), 1.0
    )
    assert beside is not None and beside.position == pytest.approx([0.55, -0.2, 0.1])
    # a direction fixed to the tool turns along, so the outer ends form a circle
    assert stop_layers._shifted_pose(pose, Line(direction=across, distance=0.05), 1.0) is None
    tilted = replace(pose, half_angle=TILT)
    assert stop_layers._shifted_pose(tilted, Line(direction=up, distance=0.05), 1.0) is None


@pytest.mark.usefixtures("few_angles")
def test_a_stop_out_of_reach_at_every_orientation_is_one_pose() -> None:
    far = replace(free_stops().stops[0], target=ConeOrientedPose(np.array([1.7, 0.0, 0.2])))
    with pytest.raises(UnreachablePose) as refusal:
        plan_cycle(free_stops(stops=[far]))
    assert refusal.value.target == "stops/pick"


@pytest.mark.long
@pytest.mark.usefixtures("few_angles")
def test_without_time_for_full_turns_the_cycle_without_them_is_the_answer() -> None:
    def search(asked: Cycle) -> CycleSolution:
        if asked.windings:
            raise DeadlineExceeded([])
        return plan_cycle(asked)

    asked = free_stops(windings=True)
    found = free_orientations.with_free_orientations(asked, search, time.perf_counter)
    assert_true(asked, found)
    assert found.status == "feasible"
    assert_reached(found, asked.arm, "pick", (0.5, -0.2, 0.1))
    # without a known cycle, the error is a passed deadline
    with pytest.raises(DeadlineExceeded):
        plan_cycle(replace(asked, deadline=FAR_TOO_SHORT))
