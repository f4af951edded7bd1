"""Targets of several kinds over HTTP."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import UnreachableTargets, load_robot
from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.app.problems import checked
from tests.app.requests import HOME, NEAR, move
from tests.app.routes.test_validation import POSE, refused
from tests.selection import long_but

FAR = {"pose": {"position": [2.0, 0.0, 0.3], "rpy": [0.0, 0.0, 0.0]}}


def test_says_which_target_it_took(client: TestClient) -> None:
    goal = {"any_of": [FAR, {"pose": POSE}, {"q": NEAR}]}
    answer = client.post("/optimize", json=move(goal=goal, candidates="all"))
    assert answer.status_code == 200, answer.text
    model_of(OptimizeAnswer).model_validate_json(answer.content)
    content = answer.json()
    assert (content["branch"]["start"]["target"], content["branch"]["goal"]["target"]) == (0, 2)
    assert content["branch"]["goal"]["q"] == NEAR
    assert {entry["goal_target"] for entry in content["candidates"]} == {1, 2}
    assert {entry["start_target"] for entry in content["candidates"]} == {0}
    (missing,) = content["unreachable"]
    assert (missing["end"], missing["target"]) == ("goal", 0)


def test_names_every_target_out_of_reach(client: TestClient) -> None:
    beyond = {"q": [*HOME[:5], 7.0]}
    answer = client.post("/optimize", json=move(start={"any_of": [FAR, beyond]}))
    assert answer.status_code == 422
    checked(UnreachableTargets, answer.content)
    content = answer.json()
    assert content["target"] == "start"
    assert [entry["target"] for entry in content["unreachable"]] == [0, 1]


PLACE = [0.4, -0.2, 0.3]
CONE = {"axis": [0, 0, 1], "direction": [0, 0, -1], "half_angle": 0.3}
UPRIGHT = [0.0, 1.0, 0.0, 0.0]


def loose(orientation: Any, **fields: Any) -> dict[str, Any]:
    return {"pose": {"position": PLACE, "orientation": orientation, **fields}}


ORIENTATIONS: list[Any] = [
    "free",
    {"cone": CONE},
    {"free_about": [0, 0, 2], "quaternion": UPRIGHT},
    {"free_about": [0, 1, 0], "rpy": [3.1, 0.1, 0.2]},
    {"free_about": [0, 0, 1], "rotvec": [0, 3.1, 0]},
]


@pytest.mark.parametrize(
    "orientation", long_but([ORIENTATIONS[k] for k in (1, 4)], ORIENTATIONS), ids=str
)
def test_chooses_the_orientation(client: TestClient, orientation: Any) -> None:
    answer = client.post("/optimize", json=move(goal=loose(orientation)))
    assert answer.status_code == 200, answer.text
    model_of(OptimizeAnswer).model_validate_json(answer.content)
    content = answer.json()
    assert content["status"] == "feasible"
    assert content["certificate"]["goal_error"]["position"] < 1e-6
    assert content["certificate"]["goal_error"]["rotation"] < 1e-6
    assert 0 <= content["energy"]["lower_bound"] <= content["energy"]["electrical"]["total"]


def test_inverse_kinematics_of_an_orientation_that_is_free_in_part(client: TestClient) -> None:
    about = {"free_about": [0, 0, 1], "rpy": [np.pi, 0, 0]}
    answer = client.post("/ik", json=loose(about) | {"windings": False}).json()
    assert not answer["complete"] and 8 < len(answer["solutions"]) <= 32
    kinematics = required_inverse_kinematics(load_robot("ur5e"), "pose")
    for found in answer["solutions"]:
        assert "wrist_3_joint" in found["free"]
        assert found["label"] == str(kinematics.label(np.array(found["q"])))


def test_a_tool_and_a_start_want_the_whole_pose(client: TestClient) -> None:
    pose = loose("free")["pose"]
    assert ["body", "tcp"] in [error["loc"] for error in refused(client, move(tcp=pose))]
    for start in (loose("free"), {"any_of": [{"q": NEAR}, loose("free")]}):
        (error,) = refused(client, move(start=start))
        assert error["loc"] == ["body", "start"] and "goal" in error["msg"]


@pytest.mark.parametrize(
    ("goal", "loc"),
    [
        ({"any_of": []}, ["body", "goal", "any_of"]),
        ({"any_of": [{"q": NEAR}] * 65}, ["body", "goal", "any_of"]),
        ({"any_of": {"q": NEAR}}, ["body", "goal", "any_of"]),
        ({"any_of": [{"any_of": [{"q": NEAR}]}]}, ["body", "goal", "any_of", 0]),
        ({"any_of": [{"q": NEAR}, {"q": NEAR, "pose": POSE}]}, ["body", "goal", "any_of", 1]),
        ({"any_of": [{"q": NEAR}, {"q": NEAR[:5]}]}, ["body", "goal", "any_of", 1, "q"]),
        ({"any_of": [{"q": [float("nan"), *NEAR[1:]]}]}, ["body", "goal", "any_of", 0, "q", 0]),
        (loose("loose"), ["body", "goal", "pose", "orientation"]),
        (loose(None), ["body", "goal", "pose", "orientation"]),
        (loose({}), ["body", "goal", "pose", "orientation"]),
        (loose("free", rpy=[0, 0, 0]), ["body", "goal", "pose"]),
        (loose({"cone": CONE, "free_about": [0, 0, 1]}), ["body", "goal", "pose", "orientation"]),
        (
            loose({"cone": {**CONE, "axis": [0, 0, 0]}}),
            ["body", "goal", "pose", "orientation", "cone", "axis"],
        ),
        (
            loose({"cone": {**CONE, "half_angle": 3.2}}),
            ["body", "goal", "pose", "orientation", "cone", "half_angle"],
        ),
        (
            loose({"cone": {**CONE, "half_angle": float("nan")}}),
            ["body", "goal", "pose", "orientation", "cone", "half_angle"],
        ),
        (
            loose({"cone": {**CONE, "direction": [0, 0]}}),
            ["body", "goal", "pose", "orientation", "cone", "direction"],
        ),
        (loose({"free_about": [0, 0, 1]}), ["body", "goal", "pose", "orientation"]),
        (
            loose({"free_about": [0, 0, 0], "rpy": [0, 0, 0]}),
            ["body", "goal", "pose", "orientation", "free_about"],
        ),
        ({"any_of": [{"q": NEAR}], "q": NEAR}, ["body", "goal"]),
        ({"any_of": [{"q": NEAR}], "all_of": []}, ["body", "goal", "all_of"]),
    ],
)
def test_names_what_is_wrong(
    client: TestClient, goal: dict[str, Any], loc: list[str | int]
) -> None:
    assert loc in [error["loc"] for error in refused(client, move(goal=goal))]
