"""Paths of stops that no configuration follows whole."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from joulepath import BranchFilter, Cycle, FreeOrder, Problem, Stop, StopPath, ToolPath
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.divided_paths import (
    PLACES,
    _cheapest_division,
    _reconfiguration_bounds,
    with_divided_paths,
)
from joulepath.optimizer.cycle.path_segments import PathSegment, path_segments
from joulepath.optimizer.kinematics.tcp import tcp_pose as pose_of
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.cycle.test_paths import FREE, a_cycle, down
from tests.optimizer.moves import ROBOT

# the first joint may turn by no more than 3.3 rad to either side: on the left it comes to its end
# on the way
OWN = ROBOT.limits
NARROW = replace(
    FREE,
    limits=OWN.tightened(
        q_min=np.array([-3.3, *OWN.q_min[1:]]), q_max=np.array([3.3, *OWN.q_max[1:]])
    ),
)
BEAD = StopPath(goal=down(0.2, 0.5, 0.2), split=True)


def glue(**given: Any) -> Stop:
    task = {
        "name": "glue",
        "target": down(0.45, -0.1, 0.2),
        "path": BEAD,
        "branch": BranchFilter("left", "up"),
    }
    return Stop(**task | given)


def divided(*stops: Stop, **given: Any) -> Cycle:
    return with_divided_paths(a_cycle(*stops, **{"arm": NARROW} | given))


def test_a_path_that_can_be_followed_stays_whole() -> None:
    asked = a_cycle(glue(), arm=FREE)
    assert with_divided_paths(asked) is asked
    whole = a_cycle(glue(branch=None), arm=NARROW)
    assert with_divided_paths(whole) is whole, "on the right"


def test_every_part_has_the_lines_of_the_stop_and_the_names_of_its_parts() -> None:
    other = Stop(name="away", target=down(0.1, 0.5, 0.3))
    order = FreeOrder(before=[("glue", "away")])
    asked = divided(glue(), other, order=order)
    assert [stop.name for stop in asked.stops] == ["glue/1", "glue", "away"]
    assert asked.order == FreeOrder(before=[("glue", "away")], together=[["glue/1", "glue"]])
    turned = divided(
        glue(), other, order=FreeOrder(before=[("away", "glue")], together=[["away", "glue"]])
    )
    assert turned.order == FreeOrder(
        before=[("away", "glue/1")], together=[["away", "glue/1", "glue"]]
    )


def test_it_is_divided_where_the_reconfiguration_has_the_least_bound() -> None:
    course = ToolCourse.of(ToolPath(), down(0.45, -0.1, 0.2).T, BEAD.goal.T)
    segments = path_segments(NARROW, course, BranchFilter("left", "up"))
    free = PreparedProblem.of(Problem(arm=NARROW, start=down(0.45, -0.1, 0.2), goal=BEAD.goal))
    on, cost = _reconfiguration_bounds(free, [free], segments)
    for at, segment in zip(on.T, segments, strict=True):
        T, wanted = pose_of(NARROW, segment.configurations(PLACES[at])), course.poses(PLACES[at])
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
    """Against all ways through drawn segments, by shortest paths one change after the other."""
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
    """The least cost of the fewest changes, and how many these are."""
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
