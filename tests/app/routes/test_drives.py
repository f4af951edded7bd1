"""Inverters, bus modes, dwell and scaled links through the service."""

from __future__ import annotations

from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from tests.app.requests import move

BALANCE = 1e-4  # relative; quadrature of the corners of power
PARTS = (
    "idle",
    "potential",
    "kinetic",
    "friction",
    "copper",
    "inverter",
    "braking",
    "recovered",
    "storage_loss",
    "dwell",
)


def answered(client: TestClient, body: dict[str, Any]) -> dict[str, Any]:
    answer = client.post("/optimize", json=body)
    assert answer.status_code == 200, answer.text
    model_of(OptimizeAnswer).model_validate_json(answer.content)
    content: dict[str, Any] = answer.json()
    electrical = content["energy"]["electrical"]
    assert sum(electrical[part] for part in PARTS) == pytest.approx(
        electrical["total"], rel=BALANCE
    )
    return content


def total(content: dict[str, Any]) -> float:
    return content["energy"]["electrical"]["total"]


def test_figures_of_the_drives_and_links_reach_the_optimiser(client: TestClient) -> None:
    plain = answered(client, move())
    assert plain["energy"]["electrical"]["inverter"] == 0
    lossy = answered(
        client, move(drives={"inverter": {"constant": [1, 1, 1, 1, 1, 3]}}, duration=1.5)
    )
    assert lossy["energy"]["electrical"]["inverter"] == pytest.approx(8 * 1.5, rel=1e-9)
    light = answered(client, move(link_mass_scale=[1, 0.5, 0.5, 1, 1, 1]))
    assert total(light) < total(plain)
    assert answered(client, move(link_mass_scale=1))["energy"] == plain["energy"]


def test_a_cycle_is_waited_out(client: TestClient) -> None:
    plain = answered(client, move())
    assert plain["energy"]["electrical"]["dwell"] == 0
    motors = answered(client, move(dwell={"time": 3.0}))
    brakes = answered(
        client, move(dwell={"time": 3.0, "hold": "brakes", "brake_delay": 0.2, "brake_power": 10.0})
    )
    assert total(plain) < total(brakes) < total(motors)
    assert brakes["energy"]["electrical"]["dwell"] > 0
    assert brakes["duration"] < 3.0
    for answer in (motors, brakes):
        assert answer["energy"]["lower_bound"] <= total(answer)
        assert answer["duration"] <= 3.0 * (1 + 1e-9)


def test_a_dwell_too_short_says_how_long(client: TestClient) -> None:
    answer = client.post("/optimize", json=move(dwell={"time": 0.05}))
    assert answer.status_code == 422
    assert answer.json()["type"].endswith("duration-too-short")
    assert answer.json()["shortest"] > 0.05


@pytest.mark.parametrize(
    ("fields", "loc"),
    [
        ({"bus": {"mode": "sOlAr"}}, ["body", "bus"]),
        ({"bus": {}}, ["body", "bus"]),
        ({"bus": "shared"}, ["body", "bus"]),
        ({"bus": {"mode": "shared", "capacity": 1.0}}, ["body", "bus", "capacity"]),
        ({"bus": {"mode": "recuperating"}}, ["body", "bus", "efficiency"]),
        ({"bus": {"mode": "recuperating", "efficiency": 1.01}}, ["body", "bus", "efficiency"]),
        ({"bus": {"mode": "storage", "capacity": -1}}, ["body", "bus", "capacity"]),
        ({"bus": {"mode": "storage", "capacity": 1e300}}, ["body", "bus", "capacity"]),
        ({"bus": {"mode": "storage", "capacity": 1, "power": 0}}, ["body", "bus", "power"]),
        ({"bus": {"mode": "storage", "capacity": 1, "initial": 2}}, ["body", "bus", "initial"]),
        ({"drives": {"inverter": {"constant": -1}}}, ["body", "drives", "inverter", "constant"]),
        ({"drives": {"inverter": {"linear": [1, 2]}}}, ["body", "drives", "inverter", "linear"]),
        ({"drives": {"gears": 1}}, ["body", "drives", "gears"]),
        ({"link_mass_scale": 0}, ["body", "link_mass_scale"]),
        ({"link_mass_scale": [1] * 5}, ["body", "link_mass_scale"]),
        ({"link_mass_scale": True}, ["body", "link_mass_scale"]),
        ({"dwell": {"hold": "brakes"}}, ["body", "dwell", "time"]),
        ({"dwell": {"time": 1e9}}, ["body", "dwell", "time"]),
        ({"dwell": {"time": 3, "brake_delay": -1}}, ["body", "dwell", "brake_delay"]),
        ({"dwell": {"time": 3, "hold": "glue"}}, ["body", "dwell", "hold"]),
        ({"dwell": {"time": 3}, "duration": 4.0}, ["body", "duration"]),
        ({"dwell": {"time": 3}, "duration": {"min": 3.5}}, ["body", "duration"]),
    ],
)
def test_names_the_field(client: TestClient, fields: dict[str, Any], loc: list[str]) -> None:
    answer = client.post("/optimize", json=move(**fields))
    assert answer.status_code == 422, answer.text
    assert loc in [error["loc"] for error in answer.json()["errors"]]
    assert "sOlAr" not in answer.text
    assert "glue" not in answer.text
