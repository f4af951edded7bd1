"""Cycles with a path of the TCP at a stop, in one piece or divided."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    Box,
    BranchFilter,
    Cycle,
    FreeOrder,
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
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.divided_paths import (
    PLACES,
    _cheapest_division,
    _reconfiguration_bounds,
    with_divided_paths,
)
from joulepath.optimizer.cycle.path_segments import PathSegment, path_segments
from joulepath.optimizer.cycle.priced_search import priced_motion
from joulepath.optimizer.cycle.stop_layers import layers_of
from joulepath.optimizer.kinematics.tcp import tcp_pose as pose_of
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.cycle.cycles import HOME, PART, pick_and_place
from tests.optimizer.cycle.test_lines import INTO
from tests.optimizer.cycle.test_optimize_cycle import assert_true, planned
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose
from tests.refusals import refusal_of

FREE = Arm(robot=ROBOT, collisions=False)
# relative difference from an optimum of another search
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
    """Lines may lead to and from a path in a given time.

    The path is at its greatest speed for most of its length; the other moves share the rest of the
    time.
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
    """Every target of a stop has its own lines, also at a price of time with shared preparation."""
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
    """The report tells the end of the path for every branch.

    The causes are a joint range for some branches, another line of the stop for others, and an
    obstacle for the last one.
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


# the first joint may turn by no more than 3.3 rad to either side: on the left it comes to its end
# on the way
OWN = ROBOT.limits
NARROW = replace(
    FREE,
    limits=OWN.tightened(
        q_min=np.array([-3.3, *OWN.q_min[1:]]), q_max=np.array([3.3, *OWN.q_max[1:]])
    ),
)
DIVIDED = StopPath(goal=down(0.2, 0.5, 0.2), split=True)


def divisible(**given: Any) -> Stop:
    task = {
        "name": "glue",
        "target": down(0.45, -0.1, 0.2),
        "path": DIVIDED,
        "branch": BranchFilter("left", "up"),
    }
    return Stop(**task | given)


def divided(*stops: Stop, **given: Any) -> Cycle:
    return with_divided_paths(a_cycle(*stops, **{"arm": NARROW} | given))


def test_a_path_that_can_be_followed_stays_whole() -> None:
    asked = a_cycle(divisible(), arm=FREE)
    assert with_divided_paths(asked) is asked
    whole = a_cycle(divisible(branch=None), arm=NARROW)
    assert with_divided_paths(whole) is whole, "on the right"


def test_every_part_has_the_lines_of_the_stop_and_the_names_of_its_parts() -> None:
    other = Stop(name="away", target=down(0.1, 0.5, 0.3))
    order = FreeOrder(before=[("glue", "away")])
    asked = divided(divisible(), other, order=order)
    assert [stop.name for stop in asked.stops] == ["glue/1", "glue", "away"]
    assert asked.order == FreeOrder(before=[("glue", "away")], together=[["glue/1", "glue"]])
    turned = divided(
        divisible(), other, order=FreeOrder(before=[("away", "glue")], together=[["away", "glue"]])
    )
    assert turned.order == FreeOrder(
        before=[("away", "glue/1")], together=[["away", "glue/1", "glue"]]
    )


def test_it_is_divided_where_the_reconfiguration_has_the_least_bound() -> None:
    course = ToolCourse.of(ToolPath(), down(0.45, -0.1, 0.2).T, DIVIDED.goal.T)
    segments = path_segments(NARROW, course, BranchFilter("left", "up"))
    free = PreparedProblem.of(Problem(arm=NARROW, start=down(0.45, -0.1, 0.2), goal=DIVIDED.goal))
    on, cost = _reconfiguration_bounds(free, [free], segments)
    for at, segment in zip(on.T, segments, strict=True):
        T, wanted = (
            pose_of(NARROW, segment.configurations(PLACES[at])),
            course.poses(PLACES[at]),
        )
        assert np.abs(T[:, :3, 3] - wanted[:, :3, 3]).max() < 2e-3, (
            "its points are joined by straight lines"
        )
    places = _cheapest_division(segments, on, cost)
    assert places is not None and len(places) == 1
    pairs = [(a, b) for a, b in np.ndindex(cost.shape[1:]) if on[0, a] and on[-1, b]]
    by_place = np.array([min(cost[p, a, b] for a, b in pairs) for p in range(len(PLACES))])
    assert PLACES[by_place.argmin()] == places[0] and 10 < by_place.min() < np.inf


@pytest.mark.parametrize("seed", range(20))
def test_the_parts_are_as_few_and_as_cheap_as_can_be(seed: int) -> None:
    """The division has the fewest parts, and the least cost among divisions with as many parts.

    The reference enumerates all ways through random segments by shortest paths.
    """
    rng = np.random.default_rng(seed)
    ends = np.sort(rng.integers(0, len(PLACES), (6, 2)), axis=1)
    ends[0, 0], ends[1, 1] = 0, len(PLACES) - 1
    segments = [PathSegment(PLACES[[a, b]], np.zeros((2, 6))) for a, b in ends]
    on = np.stack([each.covers(PLACES) for each in segments], axis=1)
    cost = np.where(
        on[:, :, None] & on[:, None, :] & ~np.eye(6, dtype=bool),
        rng.uniform(1, 2, (len(PLACES), 6, 6)),
        np.inf,
    )
    best, counts = _brute(on, cost)
    places = _cheapest_division(segments, on, cost)
    if not np.isfinite(best):
        assert places is None
        return
    assert places is not None and len(places) == counts
    at = [int(np.abs(PLACES - place).argmin()) for place in places]
    edges, totals = [0, *at, len(PLACES) - 1], list[float]()
    for way in product(range(6), repeat=len(at) + 1):
        if all(
            on[a : b + 1, segment].all()
            for (a, b), segment in zip(pairwise(edges), way, strict=True)
        ):
            totals.append(sum(cost[p, a, b] for p, (a, b) in zip(at, pairwise(way), strict=True)))
    assert min(totals) == pytest.approx(best)


def _brute(on: Array, cost: Array) -> tuple[float, int]:
    """The fewest changes between segments, and the least cost of as many changes."""
    ends, layer = len(on) - 1, {(a, 0): 0.0 for a in np.flatnonzero(on[0]).tolist()}
    for changes in range(on.shape[1] + 1):
        done = [total for (a, at), total in layer.items() if on[at:, a].all()]
        if done:
            return min(done), changes
        following: dict[tuple[int, int], float] = {}
        for (a, at), total in layer.items():
            for place in range(at + 1, ends):
                if not on[place, a]:
                    break
                for b in range(on.shape[1]):
                    if np.isfinite(cost[place, a, b]):
                        key = (b, place)
                        following[key] = min(following.get(key, np.inf), total + cost[place, a, b])
        layer = following
    return np.inf, 0
