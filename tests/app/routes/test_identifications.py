"""Identifications over HTTP: from a log to figures, and refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import (
    InvalidRequest,
    MethodNotApplicable,
    NoPowerChannel,
    NotExcited,
    NothingHeldOut,
    Payload,
    PayloadUnknown,
    load_robot,
)
from joulepath.app.api.excitation.task import ExcitationRequest
from joulepath.app.api.identifications.models import (
    Identification,
    IdentificationList,
    IdentificationSummary,
    ResidualCurves,
    ResidualMove,
)
from joulepath.app.api.identifications.route import completed
from joulepath.app.exceptions.stored import UnknownIdentification, UnknownLog
from joulepath.optimizer.exceptions import DeclaredError
from tests.app.problems import checked
from tests.app.requests import HOME
from tests.app.routes.test_problems import refused
from tests.identification_logs import FAR, Truth, csv_of, recorded, truth_of
from tests.selection import long_but

ROBOT = load_robot("ur5e")
TRUTH = truth_of(ROBOT)
CSV = {"Content-Type": "text/csv"}
# relative; every k-th row stands for all rows
THINNED = 0.15
MOST_BYTES = 500_000  # of the residuals of logs of any length
NOBODY = "3d0b7c55-8e0a-4a6b-b1f0-7a5d9c2e4f18"


NOTHING = {"payload": '{"mass": 0.0, "com": [0, 0, 0]}'}


def add_log(
    client: TestClient,
    moves: int = 8,
    seed: int = 0,
    truth: Truth = TRUTH,
    params: dict[str, str] = NOTHING,
    **options: Any,
) -> str:
    body = csv_of(recorded(ROBOT, truth, moves=moves, seed=seed), **options)
    answer = client.post("/logs", content=body, params=params, headers=CSV)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def ended(client: TestClient, **body: Any) -> Any:
    """The ended identification of a body."""
    answer = client.post("/identifications", json=body)
    assert answer.status_code == 202, answer.text
    made = Identification.model_validate_json(answer.content)
    assert answer.headers["location"] == f"/identifications/{made.id}"
    assert made.state in ("queued", "running", "done")
    with client.stream("GET", f"/jobs/{made.id}/events") as events:
        for _ in events.iter_lines():
            pass  # the stream ends with the job
    found = Identification.model_validate_json(client.get(f"/identifications/{made.id}").content)
    assert found.state in ("done", "failed")
    return found


def done(client: TestClient, **body: Any) -> Any:
    found = ended(client, **body)
    assert found.problem is None and found.result is not None, found.problem
    return found.result


@pytest.fixture(scope="module")
def log(client: TestClient) -> str:
    return add_log(client)


@pytest.fixture(scope="module")
def whole(client: TestClient, log: str) -> Any:
    """The identification of the log."""
    return ended(client, logs=[log])


def test_a_log_becomes_figures(client: TestClient, whole: Any) -> None:
    assert whole.result is not None, whole.problem
    result = whole.result
    found = {(each.figure, each.joint): each for each in result.parameters}
    coulomb = found["coulomb", 1]
    assert coulomb.identified and abs(coulomb.value - TRUTH.coulomb[1]) <= FAR * coulomb.sd
    assert coulomb.previous == ROBOT.friction.coulomb[1]
    assert found["load", 1].identified
    torque, own = result.validation.fitted.torque, result.validation.own.torque
    assert torque is not None and own is not None and max(torque.rmse) < min(own.rmse[:3])
    assert result.validation.coverage is not None
    law = result.document["friction_laws"]["identified"]
    assert law["coulomb"]["value"][1] == coulomb.value and law["coulomb"]["sd"][1] == pytest.approx(
        coulomb.sd
    )
    assert (law["coulomb"]["trust"], law["coulomb"]["unit"]) == ("B", "N·m")
    names = result.document["covariance"]["names"]
    matrix = np.array(result.document["covariance"]["matrix"])
    assert "friction_laws.identified.coulomb.1" in names and "electronics.idle_power" in names
    assert matrix.shape == (len(names), len(names)) and np.linalg.eigvalsh(matrix)[0] > -1e-9
    # stored at the end of the job, under an id from its content, equal on every server
    stored = client.put("/figures", json=result.document)
    assert stored.status_code == 200 and stored.json()["id"] == whole.figures, stored.text
    motion = {
        "configurations": [HOME, [0.5, *HOME[1:]]],
        "time_per_segment": 1.5,
        "figures": stored.json()["id"],
    }
    answer = client.post("/evaluate", json=motion)
    assert answer.status_code == 200, answer.text


def test_a_result_of_an_earlier_version_is_shown_with_empty_lists(whole: Any) -> None:
    now = whole.result.model_dump(mode="json")
    assert now["measure"] and now["validation"]["energies"]
    stored = {name: value for name, value in now.items() if name != "measure"}
    validation = {**now["validation"]}
    del validation["energies"], validation["cycles"]
    shown = completed(stored | {"validation": validation})
    empty = {"energies": [], "cycles": []}
    assert shown == now | {"measure": [], "validation": now["validation"] | empty}
    assert completed(now | {"validation": None}) == now | {"validation": None}


def residuals(client: TestClient, id: str) -> list[ResidualMove]:
    answer = client.get(f"/identifications/{id}/residuals")
    assert answer.status_code == 200, answer.text
    assert len(answer.content) < MOST_BYTES
    moves = ResidualCurves.model_validate_json(answer.content).moves
    assert moves is not None
    return moves


def test_residuals_are_those_of_moves_that_the_fit_has_not_seen(
    client: TestClient, log: str, whole: Any
) -> None:
    found = whole
    assert found.result is not None and found.result.validation.fitted.torque is not None
    moves = residuals(client, found.id)
    blind = [move for move in moves if move.held_out]
    assert len(moves) == 8 and len(blind) == found.result.validation.moves
    assert {move.log for move in moves} == {log}
    rests = [move for move in client.get(f"/logs/{log}").json()["moves"] if not move["at_rest"]]
    for move, rest in zip(sorted(moves, key=lambda each: each.t), rests, strict=True):
        assert rest["start"] <= move.t[0] < move.t[-1] <= rest["end"], "times are those of the log"
        assert move.torque is not None and move.power is not None
        lists = [
            *move.torque.measured,
            *move.torque.modelled,
            move.power.measured,
            move.power.modelled,
        ]
        assert len(lists) == 2 * 6 + 2 and {len(each) for each in lists} == {len(move.t)}
    for joint, rmse in enumerate(found.result.validation.fitted.torque.rmse):
        left = [
            measured - modelled
            for move in blind
            if move.torque is not None
            for measured, modelled in zip(
                move.torque.measured[joint], move.torque.modelled[joint], strict=True
            )
            if measured is not None and modelled is not None
        ]
        assert np.sqrt(np.mean(np.square(left))) == pytest.approx(rmse, rel=THINNED)


def test_residuals_of_other_logs_are_held_out(client: TestClient, log: str) -> None:
    other = add_log(client, moves=4, seed=6, without="iP", params=NOTHING)
    motion = add_log(client, moves=4, seed=7, without="i")
    found = ended(client, logs=[log], validate=[other, motion])
    moves = residuals(client, found.id)
    assert {(move.log, move.held_out) for move in moves} == {
        (log, False),
        (other, True),
        (motion, True),
    }
    for move in moves:
        assert (move.torque is None) == (move.log != log), "no efforts were logged"
        assert (move.power is None) == (move.log == other)


def test_identifications_are_listed(client: TestClient, whole: Any) -> None:
    name = f"Arm {whole.id}"
    assert client.patch(f"/identifications/{whole.id}", json={"name": name}).status_code == 200
    answer = client.get("/identifications", params={"search": name})
    (listed,) = IdentificationList.model_validate_json(answer.content).identifications
    known = {name: getattr(whole, name) for name in IdentificationSummary.model_fields}
    assert listed.model_dump() == known | {"robot": ROBOT.name, "name": name}


@pytest.mark.parametrize(
    ("moves", "options", "body", "problem"),
    [
        pytest.param(1, {}, {}, NothingHeldOut, marks=pytest.mark.long),
        pytest.param(
            2, {"without": "P"}, {"fit": ["power"]}, NoPowerChannel, marks=pytest.mark.long
        ),
        (4, {"without": "iP"}, {}, NotExcited),
    ],
)
def test_what_logs_do_not_tell_is_a_problem(
    client: TestClient,
    moves: int,
    options: dict[str, Any],
    body: dict[str, Any],
    problem: type[DeclaredError],
) -> None:
    found = ended(client, logs=[add_log(client, moves, **options)], **body)
    assert found.state == "failed" and found.result is None and found.problem is not None
    assert client.get(f"/identifications/{found.id}/residuals").json() == {
        "id": found.id,
        "moves": None,
    }
    checked(problem, found.problem)
    if "advice" in found.problem:
        assert ExcitationRequest.model_validate(found.problem["advice"]).robot == ROBOT.name


@pytest.mark.parametrize(
    "method",
    long_but(
        ["electrical_power"],
        ["motor_current", "electrical_power", "essential_parameters", "threshold_velocity"],
    ),
)
def test_methods_are_asked_for_by_name(client: TestClient, log: str, method: str) -> None:
    whole = ended(client, logs=[log], method=method)
    assert whole.result is not None, whole.problem
    figures = {each.figure for each in whole.result.parameters}
    assert (whole.result.thresholds is not None) == (method == "threshold_velocity")
    assert ("torque_constant" in figures) == (method == "motor_current")
    assert ("link_mass_scale" in figures) == (method == "electrical_power")
    assert any("·" in each for each in figures) == (method == "essential_parameters")
    assert whole.figures is not None


@pytest.mark.parametrize(
    "method", long_but(["periodic"], ["periodic", "base_wrench", "temperature"])
)
def test_a_method_that_the_log_does_not_fit_is_a_problem(
    client: TestClient, log: str, method: str
) -> None:
    found = ended(client, logs=[log], method=method, period=5.0)
    assert found.problem is not None
    assert checked(MethodNotApplicable, found.problem).method == method


@pytest.mark.long
def test_a_payload_is_the_difference_of_two_logs(client: TestClient, log: str) -> None:
    carried = Payload(2.0, np.array([0.01, -0.02, 0.05]))
    # the log states a wrong payload
    loaded = add_log(client, truth=replace(TRUTH, payload=carried), without="P")
    result = done(client, logs=[log, loaded], fit=["payload"])
    assert result.payload is not None
    assert abs(result.payload.mass - carried.mass) <= FAR * result.payload.mass_sd < 0.05
    assert result.payload.com == pytest.approx(carried.com, abs=0.002)
    mass = next(each for each in result.parameters if each.figure == "payload_mass")
    assert (mass.value, mass.sd) == (result.payload.mass, result.payload.mass_sd)
    wrong = ended(client, logs=[loaded, log], fit=["payload"])
    assert wrong.problem is not None and "payload last" in str(
        checked(InvalidRequest, wrong.problem).errors
    )


def test_torque_constants_need_a_payload_that_is_known(client: TestClient) -> None:
    silent = add_log(client, moves=2, params={})
    found = ended(client, logs=[silent], fit=["torque_constant"])
    joints = checked(PayloadUnknown, found.problem).joints
    assert {0, 5} <= set(joints) and not {1, 2} & set(joints)


def test_unknown_logs_are_refused_at_once(client: TestClient, log: str) -> None:
    answer = client.post("/identifications", json={"logs": [log, NOBODY]})
    refused(answer, UnknownLog)
    assert NOBODY in answer.json()["detail"]
    hidden = client.post("/identifications", json={"logs": [log, "a secret"]})
    assert "secret" not in hidden.text


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"logs": []},
        {"logs": "all"},
        {"logs": [NOBODY], "validate": {"fraction": 2.0}},
        {"logs": [NOBODY], "validate_": "moves"},
        {"logs": [NOBODY], "fit": []},
        {"logs": [NOBODY], "estimator": "best"},
    ],
)
def test_malformed_requests_name_the_field(client: TestClient, body: dict[str, Any]) -> None:
    refused(client.post("/identifications", json=body), InvalidRequest)


def test_other_jobs_are_no_identifications(client: TestClient) -> None:
    job = client.post(
        "/jobs",
        json={
            "requests": [{"evaluate": {"configurations": [HOME, HOME], "time_per_segment": 1.0}}]
        },
    ).json()
    for path in ("", "/residuals"):
        refused(client.get(f"/identifications/{job['id']}{path}"), UnknownIdentification)
