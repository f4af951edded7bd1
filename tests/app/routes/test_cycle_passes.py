"""POST /cycle through stops without a rest: one leg over all of them, in the answer, tables,
programs and replays.
"""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from tests.app.requests import HOME, PATIENT
from tests.app.routes.test_cycle import PART, ROUNDING, answered, down


def a_cycle(**fields: Any) -> dict[str, Any]:
    """A part is carried past a scanner, in two configurations of each stop."""
    stops: list[dict[str, Any]] = [
        {"name": "pick", "target": down(0.45, -0.3, 0.15), "dwell": 0.3, "payload": PART},
        {"name": "scanner", "target": down(0.45, 0.05, 0.35), "via": True},
        {"name": "place", "target": down(0.1, 0.5, 0.2), "payload": None},
    ]
    for stop in stops:
        stop["branch"] = {"shoulder": "right", "elbow": "up"}
    return {"start": {"q": HOME}, "stops": stops, "windings": False, **PATIENT, **fields}


@pytest.fixture(scope="module")
def answer(client: TestClient) -> dict[str, Any]:
    return answered(client, a_cycle())


def test_a_pass_is_part_of_one_leg(answer: dict[str, Any]) -> None:
    legs = [(leg["kind"], leg["start"]["stop"], leg["goal"]["stop"]) for leg in answer["legs"]]
    assert legs == [
        ("move", "start", "pick"),
        ("dwell", "pick", "pick"),
        ("move", "pick", "place"),
        ("move", "place", "start"),
    ]
    (scanned,) = answer["legs"][2]["passes"]
    assert scanned["stop"] == "scanner" and 0 < scanned["t"] < answer["legs"][2]["duration"]
    assert all(not leg["passes"] for leg in answer["legs"] if leg is not answer["legs"][2])
    assert answer["order"] == ["pick", "scanner", "place"]
    assert answer["certificate"]["pass_error"] < ROUNDING
    stopping = next(each for each in answer["baselines"] if each["name"] == "stopping")
    own = answer["energy"]["electrical"]["total"]
    assert stopping["electrical"] >= own and stopping["duration"] > answer["duration"]
    # the shorter cycle waits for the longer one
    assert stopping["saving"] < 1 - own / stopping["electrical"]
    assert answer["energy"]["lower_bound"] <= own


def test_its_answer_is_a_motion_through_the_stop(
    answer: dict[str, Any], client: TestClient
) -> None:
    leg = answer["legs"][2]
    kept = model_of(OptimizeAnswer).model_validate(client.get(leg["answer"]).json()["answer"])
    assert (
        kept.energy.electrical.total == leg["electrical"]
        and kept.energy.lower_bound == leg["lower_bound"]
    )
    samples = kept.trajectory
    k = int(np.argmin(np.abs(np.array(samples.t) - leg["passes"][0]["t"])))
    # at most half a sample period away from the pass, at a speed of a few rad/s
    assert np.abs(np.array(samples.q[k]) - leg["passes"][0]["q"]).max() < 0.02
    assert np.abs(samples.v[k]).max() > 0.1
    assert {each.name for each in kept.baselines} >= {"trapezoid", "controller_default"}
    assert all(each.electrical > leg["electrical"] for each in kept.baselines)


@pytest.mark.long
def test_tables_programs_and_replays_have_the_whole_leg(
    answer: dict[str, Any], client: TestClient
) -> None:
    table = client.post("/cycle", json=a_cycle(), headers={"Accept": "text/csv"})
    rows = [row for row in csv.DictReader(table.text.splitlines()) if row["leg"] == "2"]
    assert {row["kind"] for row in rows} == {"move"}
    t = np.array([float(row["t"]) for row in rows]) - answer["legs"][2]["t0"]
    assert t[0] == pytest.approx(0, abs=1e-9) and t[-1] == pytest.approx(
        answer["legs"][2]["duration"]
    )
    program = client.post("/export/urscript", json={"answer": answer})
    assert program.status_code == 200, program.text
    replayed = client.post("/replay", json={"answer": answer, **PATIENT})
    assert replayed.status_code == 200, replayed.text
    motions = replayed.json()["motions"]
    assert [each["leg"] for each in motions] == [0, 2, 3]
    assert motions[1]["duration"] == answer["legs"][2]["duration"]


WRONG = {
    "dwell": {"dwell": 0.1},
    "payload": {"payload": None},
    "approach": {"approach": {"direction": [0.0, 0.0, 1.0], "distance": 0.05}},
    "retreat": {"retreat": {"direction": [0.0, 0.0, 1.0], "distance": 0.05}},
}


@pytest.mark.parametrize("field", WRONG)
def test_what_needs_a_rest_is_refused_by_its_field(field: str, client: TestClient) -> None:
    stops = a_cycle()["stops"]
    reply = client.post("/cycle", json=a_cycle(stops=[stops[0], stops[1] | WRONG[field], stops[2]]))
    assert reply.status_code == 422 and reply.json()["type"].endswith("/invalid-request")
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 1, field]
    assert "via to false" in reply.text


@pytest.mark.parametrize(
    "fields", [{"order": "free"}, {"closed": False, "stops": a_cycle()["stops"][:2]}]
)
def test_where_the_arm_cannot_pass_is_refused(fields: dict[str, Any], client: TestClient) -> None:
    reply = client.post("/cycle", json=a_cycle(**fields))
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 1, "via"]


def test_via_is_true_or_false(client: TestClient) -> None:
    stops = a_cycle()["stops"]
    for wrong in ("yes", 1, None):
        reply = client.post(
            "/cycle", json=a_cycle(stops=[stops[0], stops[1] | {"via": wrong}, stops[2]])
        )
        assert reply.status_code == 422 and reply.json()["errors"][0]["loc"] == [
            "body",
            "stops",
            1,
            "via",
        ]
