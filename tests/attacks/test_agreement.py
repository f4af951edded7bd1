"""The same motion, asked for in different ways: with and without a duration, as a front, by a pose
or its joint positions, with all branches or one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from benchmarks.agreement import request
from joulepath import Solution, optimize, plan_cycle
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.search.tightened_limits import WITHIN_TIGHTER
from joulepath.optimizer.solve.methods import sqp_stages
from tests.selection import long_but

Json = dict[str, Any]

EXAMPLES = Path(__file__).parents[2] / "examples"
# relative: largest difference between solves of the same motion
AGREED = 1e-3
# s: out of reach on a loaded machine
DEADLINE = 120.0

ISOLATED: Json = {
    "start": {"q": [1.391, -1.57, -0.179, -1.57, 1, 0]},
    "goal": {"q": [-1.967, -0.028, 0.503, 0, 1, 0]},
    "payload": {"mass": 4.5, "com": [-0.075, -0.093, -0.03]},
    "bus": {"mode": "isolated"},
    "collisions": False,
}
SLOW_TOOL: Json = {
    "start": {"q": [1.386, -2.806, 1.791, -1.512, -0.177, -0.054]},
    "goal": {"q": [-2.052, -2.357, -1.561, -0.231, -2.324, 0.231]},
    "tcp": {"position": [-0.136, 0.036, -0.11], "rpy": [0.998, 0.2, -0.771]},
    "limits": {"tcp_speed": 0.127, "elbow_speed": 0.251},
    "collisions": False,
}


def solved(body: Json, **fields: Any) -> Solution:
    return optimize(to_problem(OptimizeRequest.model_validate(body | fields), DEADLINE))


def energy(solution: Solution) -> float:
    return solution.energy.electrical.total


@pytest.mark.long
def test_on_an_isolated_bus_no_fixed_duration_needs_less_than_a_free_one() -> None:
    free = solved(ISOLATED)
    assert energy(free) < 148.47  # J: the motion of 1.8677 s that was found before
    for duration in (1.8677, free.duration):
        assert energy(solved(ISOLATED, duration=duration)) > (1 - AGREED) * energy(free)


@pytest.mark.parametrize("index", long_but([95], [5, 13, 21, 64, 95]))
def test_its_own_duration_as_a_fixed_one_gives_the_same_energy(index: int) -> None:
    """The moves have tight limits, a payload, neither, the shortest time, or a saddle
    beside them.
    """
    _, body = request(0, index)
    free = solved(body)
    assert energy(solved(body, duration=free.duration)) == pytest.approx(energy(free), rel=AGREED)


@pytest.mark.long
@pytest.mark.parametrize(
    "index",
    [
        pytest.param(73, id="a stretched wrist"),
        pytest.param(3, id="a redundant arm"),
        pytest.param(7, id="two near branches"),
    ],
)
def test_a_cycle_of_one_stop_gives_the_same_energy(index: int) -> None:
    _, body = request(0, index)
    stops = [{"name": "goal", "target": body["goal"]}]
    asked = {name: value for name, value in body.items() if name != "goal"} | {
        "stops": stops,
        "closed": False,
    }
    found = plan_cycle(to_cycle(CycleRequest.model_validate(asked), DEADLINE))
    assert found.energy.electrical.total == pytest.approx(energy(solved(body)), rel=AGREED)


@pytest.mark.long
def test_a_motion_that_the_certificate_rejects_is_solved_again_within_tighter_limits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sqp_stages, "path_excess", lambda *_: np.zeros(2))
    found = solved(SLOW_TOOL)
    assert [each.reason for each in found.candidates] == [WITHIN_TIGHTER]
    assert found.certificate.valid and found.certificate.worst_ratio["tcp_speed"] <= 1


@pytest.mark.long
def test_a_candidate_that_is_not_refined_says_so() -> None:
    body = orjson.loads((EXAMPLES / "optimize" / "bin_to_shelf.json").read_bytes())
    labels = {"shoulder": "right", "elbow": "up", "wrist": "flip"}
    every, alone = solved(body | {"branch": None}), solved(body | {"branch": labels})
    listed = {each.goal: each for each in every.candidates if each.energy is not None}
    assert listed[every.goal.label].refined
    other = listed[alone.goal.label]
    assert (
        other.energy is not None
        and other.energy > (1 + AGREED) * energy(alone)
        and other.refined is False
    )
    assert all(each.refined is None for each in every.candidates if each.energy is None)
