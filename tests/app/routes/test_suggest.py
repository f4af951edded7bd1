"""Suggestions for a study: every figure equals the result of the suggested request."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import Arm, load_robot
from joulepath.app.api.studies.suggest.models import Suggestions
from joulepath.app.convert.pose import to_matrix
from joulepath.app.exceptions.queue import ShuttingDown
from joulepath.app.exceptions.stored import EmptyStudy
from joulepath.app.schemas.common import QuaternionPose
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.tcp import rotated_poses
from tests.app.problems import checked
from tests.app.recorded import recorded_service
from tests.app.requests import HOME, NEAR, move
from tests.app.routes.test_studies import added, begin

SAME = 1e-9
"""Relative: the optimiser computes the same from the same request; clocks only tell it when to
stop.
"""
PAYLOAD = {"mass": 2.0, "com": [0.0, 0.0, 0.2]}
TOOL = {"position": [0.0, 0.0, 0.15], "quaternion": [0.0, 0.0, 0.0, 1.0]}


def suggested(client: TestClient, path: str, **query: Any) -> dict[str, Any]:
    answer = client.get(f"{path}/suggest", params={"deadline": 60, **query})
    assert answer.status_code == 200, answer.text
    Suggestions.model_validate_json(answer.content)
    content: dict[str, Any] = answer.json()
    gains = [entry["gain"] for entry in content["suggestions"]]
    assert gains == sorted(gains, reverse=True)
    for entry in content["suggestions"]:
        assert entry["gain"] == content["base"]["energy"] - entry["energy"]
    return content


def steps(content: dict[str, Any], step: str) -> list[dict[str, Any]]:
    return [entry for entry in content["suggestions"] if entry["step"] == step]


@pytest.fixture(scope="module")
def slow(client: TestClient) -> tuple[str, dict[str, Any]]:
    """A slow straight line with a payload on a long tool, between joint positions."""
    path = begin(client, threshold=150.0)
    request = move(method="time_scaling", duration=3.0, payload=PAYLOAD, tcp=TOOL)
    added(client, path, {"optimize": request})
    return path, suggested(client, path)


def test_every_kind_of_step_is_tried(slow: Any) -> None:
    _, content = slow
    assert content["not_computed"] == []
    assert {entry["step"] for entry in content["suggestions"]} == {
        "method",
        "branch",
        "orientation",
        "duration",
        "payload",
    }


def test_what_it_promises_is_what_the_request_comes_to(client: TestClient, slow: Any) -> None:
    path, content = slow
    for entry in content["suggestions"]:
        if entry["status"] == "optimal":
            step = added(client, path, entry["request"])
            assert step["energy"] == pytest.approx(entry["energy"], rel=SAME)
            assert step["duration"] == pytest.approx(entry["duration"], rel=SAME)
            assert step["threshold_met"] == entry["threshold_met"]


def test_three_seconds_are_too_many_and_a_line_is_a_spline(slow: Any) -> None:
    _, content = slow
    free, *others = steps(content, "duration")
    assert free["request"]["optimize"].get("duration") is None
    # 37 W of idle power for the saved time, and the power of holding the load on top
    assert free["gain"] > 37 * 0.9 * (3.0 - free["duration"])
    assert free["energy"] <= min(other["energy"] for other in others) * (1 + 1e-3)
    (payload,) = steps(content, "payload")
    assert payload["request"]["optimize"]["payload"] == {"mass": 2.0, "com": [0.0, 0.0, 0.1]}
    (method,) = steps(content, "method")
    # the line is one of the B-splines
    assert method["gain"] > -1e-3 * content["base"]["energy"]


def test_other_orientations_are_of_the_same_point(slow: Any) -> None:
    _, content = slow
    robot = load_robot("ur5e")
    T_tcp = to_matrix(QuaternionPose(**TOOL))
    ((position, _),) = rotated_poses(
        Arm(robot=robot, T_flange_tcp=T_tcp), np.array(NEAR), [np.zeros(3)]
    )
    goals = [entry["request"]["optimize"]["goal"] for entry in steps(content, "orientation")]
    (free,) = [goal for goal in goals if "pose" in goal]
    assert free["pose"]["orientation"]["free_about"] == [0.0, 0.0, 1.0]
    (tilted,) = [goal["any_of"] for goal in goals if "any_of" in goal]
    assert len(tilted) == 4
    for goal in [free, *tilted]:
        assert goal["pose"]["position"] == pytest.approx(position, abs=1e-12)
    (branch,) = [
        entry
        for entry in steps(content, "branch")
        if "pose" in entry["request"]["optimize"]["goal"]
    ]
    # Inverse kinematics, with forward kinematics of its own, finds the way back.
    pose = QuaternionPose(**branch["request"]["optimize"]["goal"]["pose"])
    solutions = inverse_kinematics_for(robot).solve(to_matrix(pose), T_tcp)
    assert min(np.abs(solution.q - NEAR).max() for solution in solutions) < 1e-9


@pytest.mark.long
def test_a_branch_that_was_asked_for_is_opened(client: TestClient) -> None:
    path = begin(client)
    pose = {"pose": {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
    added(client, path, {"optimize": move(goal=pose, branch={"shoulder": "right"}, windings=False)})
    best = steps(suggested(client, path), "branch")[0]
    assert "branch" not in best["request"]["optimize"]
    assert best["gain"] > 0


def test_a_given_motion_is_optimised_between_its_ends(client: TestClient) -> None:
    path = begin(client)
    motion = {"configurations": [HOME, NEAR], "time_per_segment": 2.0, "payload": PAYLOAD}
    step = added(client, path, {"evaluate": motion})
    alone = client.post("/evaluate", json=motion).json()
    assert step["energy"] == alone["total"]["energy"]["electrical"]["total"]
    assert step["duration"] == alone["duration"] == 2.0
    content = suggested(client, path)
    free, timed = steps(content, "method")
    if "duration" in free["request"]["optimize"]:
        free, timed = timed, free
    assert timed["request"]["optimize"] == {
        "robot": "ur5e",
        "payload": PAYLOAD,
        "start": {"q": HOME},
        "goal": {"q": NEAR},
        "objective": "electrical",
        "duration": 2.0,
    }
    # A quintic is a B-spline on other knots, so the optimum in the same time costs no more.
    assert timed["gain"] > -1e-3 * content["base"]["energy"]
    assert free["gain"] > timed["gain"]
    after = added(client, path, free["request"])
    assert after["change_from_last"] == pytest.approx(-free["gain"], rel=1e-6)


@pytest.mark.parametrize(
    "configurations", [[HOME, NEAR, HOME], [HOME, NEAR, [0.5, *NEAR[1:]]], [HOME, HOME]]
)
def test_a_motion_without_two_ends_gets_none(client: TestClient, configurations: Any) -> None:
    path = begin(client)
    added(client, path, {"evaluate": {"configurations": configurations, "time_per_segment": 1.0}})
    content = suggested(client, path)
    assert content["suggestions"] == content["not_computed"] == []


def test_what_there_is_no_time_for_is_listed(client: TestClient, slow: Any) -> None:
    path, _ = slow
    content = suggested(client, path, deadline=0.001)
    assert content["suggestions"] == []
    whole = suggested(client, path)
    everything = [entry["summary"] for entry in whole["suggestions"] + whole["not_computed"]]
    assert sorted(entry["summary"] for entry in content["not_computed"]) == sorted(everything)
    assert {entry["problem"] for entry in content["not_computed"]} == {"deadline-exceeded"}


def test_what_cannot_be_is_listed(client: TestClient) -> None:
    path = begin(client)
    shortest = client.post("/optimize", json=move(duration=0.05)).json()["shortest"]
    added(client, path, {"optimize": move(duration=1.05 * shortest)})
    content = suggested(client, path)
    assert [(entry["step"], entry["problem"]) for entry in content["not_computed"]] == [
        ("duration", "duration-too-short")
    ]


def test_a_shutdown_is_told_as_one() -> None:
    with recorded_service() as stopping:
        path = begin(stopping)
        added(stopping, path, {"optimize": move()})
        assert stopping.portal is not None
        stopping.portal.call(stopping.app.state.engine.drain)  # type: ignore[attr-defined]
        answer = stopping.get(f"{path}/suggest")
    assert answer.status_code == 503
    checked(ShuttingDown, answer.content)


def test_an_empty_study_has_no_next_step(client: TestClient) -> None:
    answer = client.get(f"{begin(client)}/suggest")
    assert answer.status_code == 409
    checked(EmptyStudy, answer.content)
