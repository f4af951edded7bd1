"""What is malformed is refused as `validation`, names the field, and is not repeated."""

from __future__ import annotations

import json
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.schemas.errors import Validation
from tests.app.requests import HOME, move

SECRET = "caller-secret-7f3a"
POSE = {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}


def refused(client: TestClient, body: bytes | str | dict[str, Any], path: str = "/optimize") -> list[dict[str, Any]]:
    """The `errors` of a body that is refused."""
    content = json.dumps(body) if isinstance(body, dict) else body
    answer = client.post(path, content=content, headers={"content-type": "application/json"})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = Validation.model_validate_json(answer.content)
    assert problem.errors
    return [error.model_dump() for error in problem.errors]


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ({}, ["body", "start"]),
        (move(start={}), ["body", "start"]),
        (move(start={"q": HOME, "pose": POSE}), ["body", "start"]),
        (move(start={"q": None}), ["body", "start", "q"]),
        (move(start=HOME), ["body", "start"]),
        (move(start={"q": HOME[:5]}), ["body", "start", "q"]),
        (move(start={"q": [*HOME, 0.0]}), ["body", "start", "q"]),
        (move(start={"q": []}), ["body", "start", "q"]),
        (move(start={"q": ["0", 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [True, 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [float("nan"), 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [0, float("inf"), 0, 0, 0, 0]}), ["body", "start", "q", 1]),
        (move(start={"q": [0, 0, 10**400, 0, 0, 0]}), ["body", "start", "q", 2]),
        (move(goal={"pose": {"position": [0.4, -0.2, 0.3]}}), ["body", "goal", "pose"]),
        (move(goal={"pose": POSE | {"rpy": [0, 0, 0]}}), ["body", "goal", "pose"]),
        (move(goal={"pose": POSE | {"position": [0.4, -0.2]}}), ["body", "goal", "pose", "position"]),
        (move(goal={"pose": POSE | {"position": [1e4, 0, 0]}}), ["body", "goal", "pose", "position", 0]),
        (move(goal={"pose": POSE | {"quaternion": [0, 0, 0, 0]}}), ["body", "goal", "pose", "quaternion"]),
        (move(goal={"pose": POSE | {"quaternion": [0, 0.998, 0, 0]}}), ["body", "goal", "pose", "quaternion"]),
        (move(tcp={"position": [0, 0, 0]}), ["body", "tcp"]),
        (move(payload={"mass": -1, "com": [0, 0, 0]}), ["body", "payload", "mass"]),
        (move(payload={"mass": 1, "com": [0, 0, 0], "inertia": [1, 0, 0]}), ["body", "payload", "inertia"]),
        (move(payload={"mass": 1, "com": [0, 0, 0], "inertia": [1, 0, 0, 1, 0, 9]}), ["body", "payload", "inertia"]),
        (move(payload={"mass": 9, "com": [0, 0, 0]}), ["body", "payload", "mass"]),
        (move(gravity=[0, 0]), ["body", "gravity"]),
        (move(method="magic"), ["body", "method"]),
        (move(objective="none"), ["body", "objective"]),
        (move(objective="mechanical"), ["body", "duration"]),
        (move(objective="mechanical", duration={"min": 1.0}), ["body", "duration"]),
        (move(duration=0), ["body", "duration"]),
        (move(duration=601), ["body", "duration"]),
        (move(duration="2"), ["body", "duration"]),
        (move(duration=True), ["body", "duration"]),
        (move(duration={"min": 2.0, "max": 1.0}), ["body", "duration"]),
        (move(duration=11, sample_period=1e-4), ["body"]),
        (move(limits={"velocity": [1, 1]}), ["body", "limits", "velocity"]),
        (move(limits={"velocity": 4}), ["body", "limits", "velocity"]),
        (move(limits={"torque": 0}), ["body", "limits", "torque"]),
        (move(limits={"jerk": "fast"}), ["body", "limits", "jerk"]),
        (move(limits={"position": {"lower": 1, "upper": -1}}), ["body", "limits", "position"]),
        (move(limits={"position": {"upper": [1, 1]}}), ["body", "limits", "position", "upper"]),
        (move(branch={"elbow": "sideways"}), ["body", "branch", "elbow"]),
        (move(windings=1), ["body", "windings"]),
        (move(friction="butter"), ["body", "friction"]),
        (move(sample_period=0), ["body", "sample_period"]),
        (move(deadline=0), ["body", "deadline"]),
        (move(deadline=1e9), ["body", "deadline"]),
        (move(deadline=599), ["body", "deadline"]),
        (move(robot=5), ["body", "robot"]),
        (move(robot="x" * 65), ["body", "robot"]),
    ],
)
def test_names_the_field(client: TestClient, body: dict[str, Any], loc: list[str | int]) -> None:
    errors = refused(client, body)
    assert loc in [error["loc"] for error in errors]


@pytest.mark.parametrize(
    "body",
    [
        move(**{SECRET: 1}),
        move(start={"q": HOME, SECRET: 1}),
        move(tcp={"position": [0, 0, 0], "rpy": [0, 0, 0], SECRET: 1}),
        move(limits={"position": {SECRET: 1}}),
        move(method=SECRET),
        move(friction=SECRET),
        move(branch={"elbow": SECRET}),
        move(duration=SECRET),
        move(start=SECRET),
        f'{{"start": {SECRET}',
        f'"{SECRET}"',
    ],
)
def test_repeats_nothing(client: TestClient, body: str | dict[str, Any]) -> None:
    assert SECRET not in json.dumps(refused(client, body))


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"null",
        b"[]",
        b"{",
        b'{"start": NaN}',
        b"\xff\xfe\x00",
        b"9" * 5000,
        b"[" * 60_000,
        b'{"a":' * 10_000,
        b'{"robot": "\\ud800"}',
        b'{"\\ud800": 1}',
    ],
)
@pytest.mark.parametrize("path", ["/optimize", "/ik"])
def test_survives_what_is_no_request(client: TestClient, body: bytes, path: str) -> None:
    refused(client, body, path)


@pytest.mark.parametrize("content_type", ["text/plain", "application/xml", ""])
def test_takes_json_only(client: TestClient, content_type: str) -> None:
    answer = client.post("/optimize", content=json.dumps(move()), headers={"content-type": content_type})
    assert answer.status_code == 422
    Validation.model_validate_json(answer.content)


def test_names_only_the_first_of_many_errors(client: TestClient) -> None:
    limits = {name: ["x"] * 16 for name in ("velocity", "acceleration", "jerk", "torque")}
    assert len(refused(client, move(limits=limits))) == 20


def test_an_unknown_field_is_told_what_is_known(client: TestClient) -> None:
    (error,) = refused(client, move(goall={}))
    assert error["loc"] == ["body"]
    assert "goal" in error["msg"]
