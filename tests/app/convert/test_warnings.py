"""Warnings in answers: possibly missing branches, a missing baseline, values in unlikely units."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.convert.unlikely_units import unlikely_units
from joulepath.app.convert.warnings import MISSED, NO_DEFAULT_MOTION, certified_warnings
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.request import OptimizeRequest


def solution(complete: bool, names: list[str]) -> Any:
    """The parts of a solution read by the warnings."""
    baselines = [SimpleNamespace(name=name) for name in names]
    certificate = SimpleNamespace(close_pass=None)
    return SimpleNamespace(
        complete=complete, baselines=baselines, certificate=certificate, unmodelled=[]
    )


@pytest.mark.parametrize(
    ("complete", "names", "expected"),
    [
        (True, ["quintic", "controller_default"], []),
        (False, ["quintic", "controller_default"], [MISSED]),
        (True, ["quintic"], [NO_DEFAULT_MOTION]),
        (False, ["quintic"], [MISSED, NO_DEFAULT_MOTION]),
    ],
)
def test_each_has_its_cause(complete: bool, names: list[str], expected: list[str]) -> None:
    assert certified_warnings(solution(complete, names)) == expected


START = [0.1, -1.2, 1.1, -1.4, -1.5, 0.2]
END = [0.5, -1.0, 0.8, -1.4, -1.2, 0.4]
MOVE: dict[str, Any] = {"robot": "ur5e", "configurations": [START, END], "time_per_segment": 2.0}
AT = [-0.4, -0.2, 0.35]


def pose_goal(**orientation: list[float]) -> dict[str, Any]:
    return {
        "robot": "ur5e",
        "start": {"q": START},
        "goal": {"any_of": [{"q": END}, {"pose": {"position": AT, **orientation}}]},
    }


@pytest.mark.parametrize(
    ("orientation", "named"),
    [
        ({"rotvec": [0, 180, 0]}, True),
        ({"rpy": [180, 0, 90]}, True),
        ({"rotvec": [0, 3.1416, 0]}, False),
        ({"rpy": [-6.2832, 0, 1.5708]}, False),
    ],
)
def test_angles_in_degrees(orientation: dict[str, Any], named: bool) -> None:
    (kind,) = orientation
    found = unlikely_units(OptimizeRequest.model_validate(pose_goal(**orientation)))
    where = f"goal/any_of/1/pose/{kind}: an angle of 180 rad is implausible"
    assert [each.startswith(where) for each in found] == [True] * named


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, None),
        ({"payload": {"mass": 2, "com": [0, 0, 40]}}, "payload/com: a distance from the flange"),
        ({"tcp": {"position": [0, 0, 150], "rpy": [0, 0, 0]}}, "tcp: a distance from the flange"),
        ({"gravity": [0, 0, -1]}, "gravity: a difference from the Earth's gravity of 8.81"),
        ({"gravity": [0, 0, 9.81]}, None),
    ],
)
def test_other_units(client: TestClient, changes: dict[str, Any], said: str | None) -> None:
    found = client.post("/evaluate", json=MOVE | changes).json()["warnings"]
    assert [each.startswith(said or "-") for each in found] == [True] * (said is not None)


def test_times_in_nanoseconds() -> None:
    trajectory = {"t": [0.0, 1e9, 2e9], "q": [START, START, END]}
    asked = EvaluateRequest.model_validate({"robot": "ur5e", "trajectory": trajectory})
    assert unlikely_units(asked)[0].startswith("trajectory/t: a duration of 2e+09 s")
