"""Rounds with paths whose ends leave the angle of the tool free."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from models.robot import Array
from optimizer.exceptions import DeadlineExceeded, InvalidProblem, UnreachablePose
from optimizer.optimize_round import optimize_round
from optimizer.problem.arm import Arm
from optimizer.problem.branches import BranchFilter
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.problem.pose import Pose
from optimizer.problem.stop_path import StopPath
from optimizer.problem.stops import Stop
from optimizer.problem.tool_path import ToolPath
from optimizer.problem.work_round import WorkRound
from optimizer.sequence import free_path_ends
from tests.optimizer.clocks import CountingClock
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.optimizer.sequence.rounds import HOME
from tests.optimizer.sequence.test_optimize_round import assert_true
from tests.selection import long_but

# a nozzle beside the flange: turning it moves the wrist
NOZZLE = Arm(robot=ROBOT, collisions=False, T_flange_tcp=Pose.from_quaternion([0.15, 0, 0.1], [0, 0, 0, 1]).T)
DOWN, AXIS = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
TURNING = ToolPath(about=(0.0, 0.0, 1.0))
FROM, TO = (0.7, -0.2, 0.2), (0.7, 0.2, 0.2)
# m, and of unit vectors: the tolerances of a path
NEAR = 2e-3
# of the deadline: what is certified after it has passed
OVERRUN = 0.1


def down(at: tuple[float, float, float]) -> Pose:
    return Pose.from_quaternion(at, [0.0, 1.0, 0.0, 0.0])


def free(at: tuple[float, float, float], axis: Array = AXIS) -> ConeOrientedPose:
    return ConeOrientedPose.about(down(at), axis)


def seam(start: Any, goal: Any, **path: Any) -> WorkRound:
    """A seam in one branch, and back to the start."""
    way = StopPath(**{"goal": goal, "path": TURNING, "speed": 0.3} | path)
    branch = BranchFilter(shoulder="right", elbow="up", wrist="flip")
    stop = Stop(name="seam", target=start, path=way, branch=branch)
    return WorkRound(arm=NOZZLE, start=HOME, stops=[stop], windings=False, closed=False, deadline=AMPLE)


@pytest.fixture
def few_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer angles than a request has: each of them is a path to be solved."""
    monkeypatch.setattr(free_path_ends, "ALL_AROUND", (0.0, 2.0))
    monkeypatch.setattr(free_path_ends, "STEPS", (0.3,))


@pytest.mark.usefixtures("few_angles")
@pytest.mark.parametrize(
    ("free_start", "free_goal"), long_but([(False, True)], [(False, True), (True, False), (True, True)])
)
def test_the_angles_are_chosen_for_the_whole_round(free_start: bool, free_goal: bool) -> None:
    start, goal = free(FROM) if free_start else down(FROM), free(TO) if free_goal else down(TO)
    asked, given = seam(start, goal), optimize_round(seam(down(FROM), down(TO)))
    found = optimize_round(asked)
    assert_true(asked, found)
    assert found.status == "feasible"
    # a bound over all angles holds for these, too
    assert 0 < found.lower_bound <= given.energy.electrical.total
    path = found.moves[1]
    assert path.planned.kind == "path" and (path.solution.start.target, path.solution.goal.target) == (0, 0)
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
def test_a_deadline_gives_a_round_or_says_so(readings: int) -> None:
    asked = replace(seam(down(FROM), free(TO)), deadline=float(readings))
    try:
        found = optimize_round(asked, clock=CountingClock())
    except DeadlineExceeded:
        return
    assert_true(asked, found)
    assert found.wall_time <= readings * (1 + OVERRUN)


def test_a_start_out_of_reach_at_every_angle_is_one_pose() -> None:
    with pytest.raises(UnreachablePose) as refusal:
        optimize_round(seam(free((1.7, -0.2, 0.2)), free((1.7, 0.2, 0.2))))
    assert refusal.value.target == "stops/seam/entry" and "angles" in str(refusal.value)


@pytest.mark.parametrize(
    ("start", "goal", "path", "field", "word"),
    [
        (free(FROM), free(TO), {"path": ToolPath()}, "stops.0.path.points.0.orientation", "about"),
        (down(FROM), free(TO, np.array([1.0, 0, 0])), {}, "stops.0.path.points.1.orientation", "same axis"),
        (ConeOrientedPose(np.array(FROM)), down(TO), {}, "stops.0.path.points.0.orientation", "in full"),
        (free(FROM), down(TO), {"split": True}, "stops.0.path.points.0.orientation", "split"),
    ],
)
def test_an_end_that_is_free_otherwise_names_its_field(
    start: Any, goal: Any, path: dict[str, Any], field: str, word: str
) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        seam(start, goal, **path)
    assert refusal.value.field == field and word in str(refusal.value)
