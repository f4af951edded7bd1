"""Cycles with lines into and out of stops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    Box,
    Cycle,
    InvalidProblem,
    Line,
    Obstacle,
    PathInfeasible,
    Pose,
    Scene,
    Stop,
    StopInCollision,
    load_robot,
    plan_cycle,
)
from tests.optimizer.cycle.cycles import HOME, pick_and_place
from tests.optimizer.cycle.test_optimize_cycle import planned
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.refusals import refusal_of

INTO = Line(direction=np.array([0.0, 0.0, 1.0]), distance=0.08)
OUT = Line(direction=np.array([0.0, 0.0, 2.0]), frame="base", distance=0.06, speed=0.3)
# relative difference from an optimum of another search
CONVERGED = 2e-3


def with_lines(asked: Cycle, **given: Any) -> Cycle:
    lines = {"approach": INTO, "retreat": OUT} | given
    return replace(asked, stops=[replace(stop, **lines) for stop in asked.stops])


def one_stop(**given: Any) -> Cycle:
    return with_lines(pick_and_place(1, 1, windings=False), **given)


def test_the_tool_comes_and_leaves_straight() -> None:
    asked = with_lines(pick_and_place(1, 2, windings=False))
    found = planned(asked)
    assert [move.planned.tool_path is not None for move in found.moves] == [
        False,
        True,
        True,
    ] * 2 + [False]
    for move in found.moves:
        if move.planned.tool_path is None:
            continue
        into = move.planned.goal in ("stop 0", "stop 1")
        spline = move.solution.trajectory.spline
        T = np.array([tcp_pose(q).T for q in spline.curve(np.linspace(0.0, spline.duration, 500))])
        at_stop = T[-1] if into else T[0]
        along = at_stop[:3, 2] if into else np.array([0.0, 0.0, 1.0])
        ways = (T[:, :3, 3] - T[0, :3, 3]) @ along
        assert ways[-1] == pytest.approx(INTO.distance if into else OUT.distance, abs=1e-6)
        assert (
            np.linalg.norm(T[:, :3, 3] - T[0, :3, 3] - ways[:, None] * along, axis=1).max() < 1e-4
        )
        assert np.abs(T[:, :3, :3] - at_stop[:3, :3]).max() < 2e-3
        if not into:
            assert (
                np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1).max()
                < 0.3 * spline.duration / 499 * 1.001
            )
    (carried,) = {
        move.planned.arm.payload.mass for move in found.moves if move.planned.start == "stop 0"
    }
    assert carried == 2.0, "what is taken up is lifted along the line"


def test_what_is_grasped_is_no_obstacle_on_the_lines() -> None:
    """A box around the stop blocks every way except the lines, and is no obstacle on the lines."""
    (stop,) = pick_and_place(1, 1).stops
    assert isinstance(stop.target, Pose)
    box = Obstacle(
        "part",
        Box(np.array([0.04, 0.04, 0.04])),
        Pose.from_rotation(stop.target.T[:3, 3], np.eye(3)).T,
    )
    arm = Arm(robot=ROBOT, scene=Scene([box]))
    lines = {"approach": INTO, "retreat": OUT}
    held = replace(stop, dwell=0.1, payload=None, obstacles_ignored=["part"], **lines)
    asked = Cycle(arm=arm, start=HOME, stops=[held], windings=False, deadline=AMPLE)
    planned(asked)
    with pytest.raises(StopInCollision):
        plan_cycle(replace(asked, stops=[replace(held, obstacles_ignored=[])]))
    with pytest.raises(StopInCollision):
        plan_cycle(replace(asked, stops=[replace(held, retreat=None)]))


def test_a_redundant_arm_approaches_as_it_was_followed_from_the_stop() -> None:
    """The line to a stop of a redundant arm is traced from the stop.

    From the outer end, the line would lead to another configuration of the stop.
    """
    stop = Stop(name="stop", target=np.array([0.5, -0.3, 0.4, -1.8, 0.3, 1.8, 0.7]), approach=INTO)
    found = plan_cycle(
        Cycle(
            arm=Arm(robot=load_robot("panda"), collisions=False),
            start=np.array([0.3, -0.5, 0.2, -2.0, 0.1, 1.6, 0.5]),
            stops=[stop],
            closed=False,
            windings=False,
            with_baselines=False,
        )
    )
    assert np.array_equal(found.moves[-1].solution.goal.q, stop.target)
    assert found.moves[-1].solution.certificate.valid


def test_a_line_that_no_configuration_follows_says_how_far_each_gets() -> None:
    far = Line(direction=np.array([0.0, 0.0, 1.0]), frame="base", distance=1.5)
    with pytest.raises(PathInfeasible) as refusal:
        plan_cycle(one_stop(retreat=far))
    assert refusal.value.path == "stops/stop 0/retreat" and refusal.value.length == 1.5
    assert {each.reason for each in refusal.value.attempts} <= {"unreachable", "singular"}
    assert "shorten the line" in str(refusal.value)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"direction": [0.0, 0.0, 0.0]}, "direction"),
        ({"direction": [0.0, np.nan, 1.0]}, "direction"),
        ({"distance": 0.0}, "distance"),
        ({"distance": np.inf}, "distance"),
        ({"frame": "world"}, "frame"),
        ({"speed": 0.0}, "speed"),
    ],
    ids=str,
)
def test_a_wrong_line_names_its_field(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        Line(**{"direction": [0.0, 0.0, 1.0], "distance": 0.1} | given)


@pytest.mark.parametrize(("first", "second"), [("a", "a/approach"), ("a/approach", "a")])
def test_the_outer_ends_of_lines_have_names_of_their_own(first: str, second: str) -> None:
    stops = [Stop(name=name, target=HOME, approach=INTO) for name in (first, second)]
    with refusal_of("stops.1.name"):
        Cycle(arm=Arm(robot=ROBOT), start=HOME, stops=stops)


def test_an_unknown_obstacle_is_named() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        one_stop(obstacles_ignored=["part"])
    assert refusal.value.field == "stops.0.obstacles_ignored" and "part" in str(refusal.value)
