"""POST /excitation: a certified motion for the other endpoints, and problems with their cause."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import DeadlineExceeded, ExcitationInfeasible, InvalidRequest, OutsideLimits
from joulepath.app.answers.declared import model_of
from joulepath.app.api.excitation.task import ExcitationAnswer
from joulepath.app.schemas.examples.files import body_examples
from tests.app.requests import HOME
from tests.app.routes.test_problems import refused

EXAMPLE = body_examples("/excitation")["application/json"]["friction_and_rotors"]["value"]
SHORT: dict[str, Any] = EXAMPLE | {"deadline": 100.0, "centre": HOME}


@pytest.fixture(scope="module")
def found(client: TestClient) -> dict[str, Any]:
    answer = client.post("/excitation", json=SHORT)
    assert answer.status_code == 200, answer.text
    model_of(ExcitationAnswer).model_validate_json(answer.content)
    return answer.json()


def test_the_motion_rests_at_its_ends_and_keeps_its_limits(found: dict[str, Any]) -> None:
    trajectory, certificate = found["trajectory"], found["certificate"]
    for rates in (trajectory["v"], trajectory["a"]):
        assert np.abs([rates[0], rates[-1]]).max() < 1e-6
    assert certificate["worst_ratio"]["velocity"] <= 0.6 * (1 + 1e-6)
    assert certificate["clearance"]["min_clearance"] >= 0.02
    assert found["coefficients"]["centre"] == pytest.approx(HOME)
    assert (found["starts"], found["feasible"]) == (1, 1)
    names = [each["parameter"] for each in found["predicted_sd"]]
    assert sum(not name.startswith("load") for name in names) == 4 + 18
    assert {"coulomb6", "load2", "load3"} <= set(names)
    assert found["arm"]["payload"]["mass"] == 2.0
    assert 1 < found["scaled_condition"] <= 60


def test_evaluate_takes_its_table_and_agrees(client: TestClient, found: dict[str, Any]) -> None:
    table = client.post("/excitation", json=SHORT, headers={"Accept": "text/csv"})
    assert table.headers["content-type"].startswith("text/csv")
    query = {"payload": '{"mass": 2.0, "com": [0.0, 0.0, 0.05]}'}
    answer = client.post(
        "/evaluate", content=table.content, params=query, headers={"Content-Type": "text/csv"}
    )
    assert answer.status_code == 200, answer.text
    assert answer.json()["within_limits"] and not answer.json()["collides"]
    # of the samples' splines against the motion's own
    assert answer.json()["total"]["energy"]["electrical"]["total"] == pytest.approx(
        found["energy"]["electrical"]["total"], rel=1e-3
    )


def test_no_room(client: TestClient) -> None:
    shape = {"shape": "sphere", "radius": 0.5}
    ball = {
        "name": "ball",
        **shape,
        "pose": {"position": [0.0, 0.0, 0.3], "rotvec": [0.0, 0.0, 0.0]},
    }
    body = SHORT | {"scene": {"obstacles": [ball]}}
    assert (
        refused(client.post("/excitation", json=body), ExcitationInfeasible)["limit"] == "clearance"
    )


WRONG: list[tuple[dict[str, Any], list[str]]] = [
    ({"period": 0.5}, ["body", "period"]),
    ({"harmonics": 99}, ["body", "harmonics"]),
    ({"parameters": ["power"]}, ["body", "parameters", "0"]),
    ({"for": ["friction"]}, ["body", "for"]),
    ({"speed_fraction": 1.5}, ["body", "speed_fraction"]),
    ({"centre": [0.0]}, ["body", "centre"]),
    ({"noise": [1.0]}, ["body", "noise"]),
    ({"sample_period": 1e-4, "period": 60.0}, ["body", "sample_period"]),
    (
        {"tool_cone": {"axis": [0, 0, 1], "direction": [0, 0, -1], "half_angle": 0.2}},
        ["body", "tool_cone"],
    ),
]


@pytest.mark.parametrize(("wrong", "loc"), WRONG, ids=[next(iter(wrong)) for wrong, _ in WRONG])
def test_wrong_requests(client: TestClient, wrong: dict[str, Any], loc: list[str]) -> None:
    content = refused(client.post("/excitation", json=SHORT | wrong), InvalidRequest)
    assert [[str(part) for part in error["loc"]] for error in content["errors"]] == [loc]


def test_a_centre_beyond_the_range_and_too_little_time(client: TestClient) -> None:
    far = refused(
        client.post("/excitation", json=SHORT | {"centre": [0.0, 20.0, 0, 0, 0, 0]}), OutsideLimits
    )
    assert far["joint"] == "shoulder_lift_joint"
    refused(client.post("/excitation", json=SHORT | {"deadline": 1e-3}), DeadlineExceeded)
