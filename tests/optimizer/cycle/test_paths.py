"""Cycles with a path of the TCP at a stop."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    Box,
    BranchFilter,
    Cycle,
    Line,
    Obstacle,
    PathInfeasible,
    Payload,
    Pose,
    Problem,
    Scene,
    Stop,
    StopPath,
    ToolPath,
    optimize,
    plan_cycle,
)
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.priced_search import priced_motion
from joulepath.optimizer.cycle.stop_layers import layers_of
from tests.optimizer.cycle.cycles import HOME, PART, pick_and_place
from tests.optimizer.cycle.test_lines import INTO
from tests.optimizer.cycle.test_optimize_cycle import assert_true, planned
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.refusals import refusal_of

FREE = Arm(robot=ROBOT, collisions=False)
# relative: an optimum that is reached in another search
CONVERGED = 2e-3


def down(x: float, y: float, z: float) -> Pose:
    return Pose.from_quaternion([x, y, z], [0.0, 1.0, 0.0, 0.0])


CORNER = down(0.45, 0.1, 0.2)
BEAD = StopPath(goal=down(0.3, 0.1, 0.2), path=ToolPath(via=[CORNER], blend=0.03), speed=0.25)


def glue(**given: Any) -> Stop:
    return Stop(**{"name": "glue", "target": down(0.45, -0.1, 0.2), "path": BEAD} | given)


def a_cycle(*stops: Stop, **given: Any) -> Cycle:
    return Cycle(
        **{"arm": FREE, "start": HOME, "stops": stops, "windings": False, "deadline": AMPLE} | given
    )


def test_the_tool_follows_the_path_and_rests_at_its_ends() -> None:
    asked = a_cycle(
        glue(dwell=0.2, payload=PART),
        Stop(name="away", target=down(0.1, 0.5, 0.3), payload=Payload()),
    )
    found = planned(asked)
    assert found.order == ["glue", "away"]
    path = found.moves[1]
    assert (path.planned.kind, path.planned.start, path.planned.goal) == (
        "path",
        "glue/entry",
        "glue",
    )
    spline = path.solution.trajectory.spline
    T = np.array([tcp_pose(q).T for q in spline.curve(np.linspace(0.0, spline.duration, 2000))])
    p, turned = T[:, :3, 3], T[:, :3, :3] - CORNER.T[:3, :3]
    on_first, on_second = (
        np.abs(p - [0.45, 0, 0.2])[:, [0, 2]].max(axis=1),
        np.abs(p - [0, 0.1, 0.2])[:, 1:].max(axis=1),
    )
    in_blend = np.linalg.norm(p - CORNER.T[:3, 3], axis=1) < 0.03
    assert np.minimum(on_first, on_second)[~in_blend].max() < 1e-4 and np.abs(turned).max() < 2e-3
    assert (
        np.abs(p[0] - [0.45, -0.1, 0.2]).max() < 1e-6
        and np.abs(p[-1] - [0.3, 0.1, 0.2]).max() < 1e-6
    )
    assert np.linalg.norm(np.diff(p, axis=0), axis=1).max() <= 0.25 * spline.duration / 1999 * 1.001
    assert path.dwell_energy > 0 and found.moves[0].dwell_energy == 0, (
        "it dwells where the path ends"
    )
    assert [move.planned.arm.payload.mass for move in found.moves] == [0.0, 0.0, 2.0, 0.0]


@pytest.mark.long
def test_it_is_the_least_over_all_branches_of_the_path() -> None:
    asked = a_cycle(glue())
    found, (start, entry, end), energies = plan_cycle(asked), list(layers_of(asked).values()), []
    assert (entry.name, end.name) == ("stops/glue/entry", "stops/glue") and len(end.q) == len(
        entry.q
    ) > 1
    for first, last in zip(entry.q, end.q, strict=True):
        ends, total = [start.q[0], first, last, start.q[0]], 0.0
        for move, q_start, q_goal in zip(asked.moves, ends, ends[1:], strict=False):
            task = Problem(
                arm=move.arm,
                start=q_start,
                goal=q_goal,
                tool_path=move.tool_path,
                windings=False,
                deadline=AMPLE,
            )
            total += optimize(task).energy.electrical.total
        energies.append(total)
    assert found.status == "optimal" and found.energy.electrical.total == pytest.approx(
        min(energies), rel=CONVERGED
    )


@pytest.mark.long
def test_lines_lead_to_a_path_and_from_it_in_a_given_time() -> None:
    """The path is at its greatest speed for most of its length: all the time that is left is for
    the other moves.
    """
    asked = a_cycle(
        glue(approach=INTO, retreat=replace(INTO, distance=0.05), branch=BranchFilter("left", "up"))
    )
    free = planned(asked)
    assert [move.planned.kind for move in free.moves] == ["move", "line", "path", "line", "move"]
    duration = 1.2 * free.duration
    timed = plan_cycle(replace(asked, duration_min=duration, duration_max=duration))
    assert timed.duration == pytest.approx(duration)
    assert all(move.solution.certificate.valid for move in timed.moves)
    assert all(each.saving > 0 for each in timed.baselines if each.within_limits)


def test_each_of_several_targets_has_lines_of_its_own() -> None:
    """At a price of time, too, where the motions of a leg share what is prepared."""
    (first,), (second,) = pick_and_place(1, 1).stops, pick_and_place(5, 1).stops
    either = AnyOf((first.target, second.target))  # type: ignore[arg-type]
    stop = replace(
        first, target=either, approach=INTO, branch=BranchFilter("left", "up", "no_flip")
    )
    search = CycleSearch(a_cycle(stop), time.perf_counter)
    line = search.legs[1]
    assert {line.start.ends[end].target for end in line.start.end} == {0, 1}
    for node in range(len(line.start.q)):
        motion = priced_motion(line, node, node, 0.0, 10.0, search.end)
        assert motion is not None and np.allclose(
            motion.spline.control_points[-1], line.goal.q[node]
        )


@pytest.mark.long
def test_what_ends_a_path_is_told_of_each_branch() -> None:
    """A joint range is in the way of some, another line of the stop in that of others, an obstacle
    of the last.
    """
    own = ROBOT.limits
    narrow = own.tightened(
        q_min=np.array([-3.3, *own.q_min[1:]]), q_max=np.array([3.3, *own.q_max[1:]])
    )
    away = Line(direction=np.array([0.0, 0.0, 1.0]), frame="base", distance=1.5)
    with pytest.raises(PathInfeasible) as refusal:
        plan_cycle(a_cycle(glue(retreat=away), arm=replace(FREE, limits=narrow)))
    assert refusal.value.path == "stops/glue/retreat"
    beside = glue(path=StopPath(goal=down(0.2, 0.5, 0.2)), branch=BranchFilter("left"))
    with pytest.raises(PathInfeasible) as refusal:
        plan_cycle(a_cycle(beside, arm=replace(FREE, limits=narrow)))
    assert {each.reason for each in refusal.value.attempts} == {"outside_limits"}
    assert all(0 < each.followed < 1 for each in refusal.value.attempts)
    block = Obstacle(
        "block", Box(np.array([0.1, 0.1, 0.1])), Pose.from_rotation([0.3, 0.1, 0.2], np.eye(3)).T
    )
    with pytest.raises(PathInfeasible) as refusal:
        plan_cycle(a_cycle(glue(), arm=Arm(robot=ROBOT, scene=Scene([block]))))
    assert "in_collision" in {each.reason for each in refusal.value.attempts}
    # at the stop, on its lines and its path it does not count, but the arm has to get out
    ignored = glue(
        obstacles_ignored=["block"],
        retreat=replace(INTO, direction=np.array([0.0, 0.0, -1.0]), distance=0.2),
    )
    assert_true(
        asked := a_cycle(ignored, arm=Arm(robot=ROBOT, scene=Scene([block]))), plan_cycle(asked)
    )


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"target": HOME}, "stops.0.target"),
        ({"path": replace(BEAD, goal=CORNER)}, "stops.0.path"),
        (
            {"path": replace(BEAD, path=ToolPath(via=[CORNER, CORNER], blend=0.01))},
            "stops.0.path.points.2",
        ),
        ({"name": "glue/entry"}, "stops.1.name"),
    ],
    ids=[
        "joint positions",
        "the last poses are one",
        "a pose twice",
        "the name of the start of a path",
    ],
)
def test_a_wrong_path_names_its_field(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        plan_cycle(a_cycle(glue(**given), *([glue()] if "name" in given else [])))


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan])
def test_a_wrong_speed_is_refused(speed: float) -> None:
    with refusal_of("path.speed"):
        replace(BEAD, speed=speed)
