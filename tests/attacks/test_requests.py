"""Requests as sent by users, and the promises of answers: ends, warnings, ids, logs, payloads."""

from __future__ import annotations

import re
from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.app.requests import HOME, NEAR, PATIENT


def pose(position: list[float]) -> dict[str, Any]:
    """A pose without a turn."""
    return {"position": position, "quaternion": [0.0, 0.0, 0.0, 1.0]}


TABLE = {"obstacles": [{"name": "table", "shape": "half_space", "pose": pose([0.0, 0.0, -0.02])}]}
THROUGH: dict[str, Any] = {
    "robot": "ur10e",
    "tcp": pose([0.0, 0.0, 0.15]),
    "payload": {"mass": 4.0, "com": [0.0, 0.0, 0.15]},
    "start": {"q": HOME},
    "goal": {"pose": {"position": [0.7, 0.3, -0.1], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    "scene": TABLE,
    **PATIENT,
}
"""A gripper and a part that end 80 mm below the surface of a table, if only the arm itself is kept
clear of it.
"""
ABOVE = {"pose": {"position": [0.7, 0.3, 0.02], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
DEPTH = 80
BALL = 86
"""Radius [mm] of a ball of 4 kg at 1500 kg/m³."""


def depths(warnings: list[str]) -> dict[str, int]:
    """Depth in the table [mm] by the name of the shapeless part, tool or payload."""
    said = "\n".join(warnings)
    found = re.findall(
        r"The (tool|payload) has no shape.* would be (\d+) mm deep in table at \d\.\d{3} s", said
    )
    return {what: int(depth) for what, depth in found}


def test_a_gripper_without_a_shape_is_said_to_be_in_the_table(client: TestClient) -> None:
    answer = client.post("/optimize", json=THROUGH).json()
    found = depths(answer["warnings"])
    assert found["tool"] >= DEPTH and found["payload"] >= DEPTH + BALL
    assert all(
        "`tool.capsules`" in said or "`payload.shape`" in said for said in answer["warnings"]
    )


@pytest.mark.long
def test_the_remedy_of_the_warning_works(client: TestClient) -> None:
    """With shapes, the goal in the table is refused; above it, the motion is clear without a
    warning.
    """
    tool = {"capsules": [{"start": [0, 0, 0.06], "end": [0, 0, 0.13], "radius": 0.02}]}
    box = {"shape": "box", "size": [0.1, 0.1, 0.1], "pose": pose([0.0, 0.0, 0.15])}
    shaped = THROUGH | {"tool": tool, "payload": {**THROUGH["payload"], "shape": box}}
    refused = client.post("/optimize", json=shaped)
    assert refused.status_code == 422 and "table" in refused.json()["detail"]
    above = {"pose": {"position": [0.7, 0.3, 0.06], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
    answer = client.post("/optimize", json=shaped | {"goal": above})
    assert answer.status_code == 200, answer.text
    assert (
        depths(answer.json()["warnings"]) == {}
        and answer.json()["certificate"]["clearance"]["min_clearance"] >= 0
    )


@pytest.mark.long
def test_points_rows_and_recordings_say_it_too(client: TestClient) -> None:
    front = client.post("/pareto", json=THROUGH | {"points": 2}).json()
    compared = client.post(
        "/compare", json=THROUGH | {"methods": ["bspline"], "answers": True}
    ).json()
    stored = client.get(front["points"][-1]["answer"]).json()["answer"]
    motion = {"t": stored["trajectory"]["t"], "q": stored["trajectory"]["q"]}
    arm = {name: THROUGH[name] for name in ("robot", "tcp", "payload", "scene")}
    given = client.post("/evaluate", json=arm | {"trajectory": motion}).json()
    for answer in (stored, compared["methods"][0]["answer"], given):
        found = depths(answer["warnings"])
        assert found["tool"] >= DEPTH and found["payload"] >= DEPTH + BALL


@pytest.mark.long
def test_each_move_of_a_cycle_has_its_own_payload(client: TestClient) -> None:
    """The tool stays above the table; only the part, on its way from pick to place, reaches into
    it.
    """
    target = {"pose": {"position": [0.7, -0.3, 0.02], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
    stops = [
        {"name": "pick", "target": target, "payload": {"mass": 4.0, "com": [0.0, 0.0, 0.15]}},
        {"name": "place", "target": ABOVE, "payload": None},
    ]
    asked = {name: THROUGH[name] for name in ("robot", "tcp", "start", "scene", "deadline")}
    answer = client.post("/cycle", json=asked | {"stops": stops, "windings": False})
    assert answer.status_code == 200, answer.text
    said = [each for each in answer.json()["warnings"] if "no shape" in each]
    assert len(said) == 1 and said[0].startswith("pick to place: The payload has no shape")


def test_a_payload_without_mass_needs_no_centre(client: TestClient) -> None:
    asked = {"start": {"q": HOME}, "goal": {"q": NEAR}, **PATIENT}
    nothing, empty = (
        client.post("/optimize", json=asked | {"payload": each}) for each in (None, {"mass": 0})
    )
    assert nothing.status_code == empty.status_code == 200, empty.text
    assert empty.json()["energy"] == nothing.json()["energy"]
    refused = client.post("/optimize", json=asked | {"payload": {"mass": 1e-9}})
    assert refused.json()["errors"][0]["loc"] == ["body", "payload", "com"]
    stop = {"target": {"q": NEAR}, "payload": {"mass": 0}}
    assert (
        client.post("/cycle", json={"start": {"q": HOME}, "stops": [stop], **PATIENT}).status_code
        == 200
    )
    arm = {"payload": {"mass": 0}}
    changed = client.post(
        "/whatif", json={"optimize": asked, "changes": [{"name": "empty", "arm": arm}], **PATIENT}
    )
    assert changed.status_code == 200, changed.text


def test_an_id_of_the_caller_is_no_id_of_an_answer(client: TestClient) -> None:
    """The id of a request may even equal the id of another kept answer."""
    asked = {"start": {"q": HOME}, "goal": {"q": NEAR}, **PATIENT}
    first = client.post("/optimize", json=asked).json()
    second = client.post("/optimize", json=asked, headers={"X-Request-ID": first["id"]}).json()
    assert second["request"] == first["id"] != second["id"]
    assert client.get(second["answer"]).json()["answer"] == second


@pytest.mark.parametrize("path", ["evaluate", "compare", "ik"])
def test_an_answer_that_is_not_kept_has_no_id(client: TestClient, path: str) -> None:
    bodies: dict[str, dict[str, Any]] = {
        "evaluate": {"configurations": [HOME, NEAR], "time_per_segment": 1.5},
        "compare": {
            "start": {"q": HOME},
            "goal": {"q": NEAR},
            "methods": ["bspline"],
            "answers": True,
            **PATIENT,
        },
        "ik": {"pose": {"position": [0.4, -0.2, 0.35], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
    }
    answer = client.post(f"/{path}", json=bodies[path], headers={"X-Request-ID": "mine"}).json()
    assert answer["request"] == "mine" and answer["id"] is None
    for row in answer.get("methods", []):
        assert (
            row["answer"]["request"] == "mine"
            and row["answer"]["id"] is row["answer"]["answer"] is None
        )
