"""POST /cycle through stops without a rest, and with lines and paths of the TCP at its stops."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.cycle.task import CycleAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from tests.app.requests import HOME, PATIENT
from tests.app.routes.test_cycle import PART, ROUNDING, a_cycle, answered, down


def passing_cycle(**fields: Any) -> dict[str, Any]:
    """A part is carried past a scanner, in two configurations at every stop."""
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
    return answered(client, passing_cycle())


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
    table = client.post("/cycle", json=passing_cycle(), headers={"Accept": "text/csv"})
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
    stops = passing_cycle()["stops"]
    reply = client.post(
        "/cycle", json=passing_cycle(stops=[stops[0], stops[1] | WRONG[field], stops[2]])
    )
    assert reply.status_code == 422 and reply.json()["type"].endswith("/invalid-request")
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 1, field]
    assert "via to false" in reply.text


@pytest.mark.parametrize(
    "fields", [{"order": "free"}, {"closed": False, "stops": passing_cycle()["stops"][:2]}]
)
def test_where_the_arm_cannot_pass_is_refused(fields: dict[str, Any], client: TestClient) -> None:
    reply = client.post("/cycle", json=passing_cycle(**fields))
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 1, "via"]


def test_via_is_true_or_false(client: TestClient) -> None:
    stops = passing_cycle()["stops"]
    for wrong in ("yes", 1, None):
        reply = client.post(
            "/cycle", json=passing_cycle(stops=[stops[0], stops[1] | {"via": wrong}, stops[2]])
        )
        assert reply.status_code == 422 and reply.json()["errors"][0]["loc"] == [
            "body",
            "stops",
            1,
            "via",
        ]


LINES = {
    "approach": {"direction": [0.0, 0.0, 1.0], "distance": 0.08},
    "retreat": {"direction": [0.0, 0.0, 1.0], "frame": "base", "distance": 0.06, "speed": 0.3},
}


def with_lines(**fields: Any) -> dict[str, Any]:
    """The cycle of `a_cycle`, its first stop with lines."""
    content = a_cycle()
    content["stops"][0] |= LINES | fields
    return content


@pytest.mark.parametrize(
    ("fields", "where"),
    [
        ({"approach": {"direction": [0.0, 0.0, 0.0], "distance": 0.1}}, ["approach", "direction"]),
        ({"approach": {"direction": [0.0, 0.0, 1.0]}}, ["approach", "distance"]),
        ({"retreat": {"direction": [0.0, 0.0, 1.0], "distance": 9.0}}, ["retreat", "distance"]),
        (
            {"retreat": {"direction": [0.0, 0.0, 1.0], "distance": 0.1, "frame": "world"}},
            ["retreat", "frame"],
        ),
        ({"obstacles_ignored": ["part"]}, ["obstacles_ignored"]),
    ],
)
def test_a_wrong_line_names_its_field(
    client: TestClient, fields: dict[str, Any], where: list[str]
) -> None:
    reply = client.post("/cycle", json=with_lines(**fields))
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 0, *where]


def test_a_line_that_no_configuration_follows_says_how_far_each_gets(client: TestClient) -> None:
    far = {"direction": [0.0, 0.0, 1.0], "frame": "base", "distance": 1.8}
    reply = client.post("/cycle", json=with_lines(retreat=far))
    problem = reply.json()
    assert (reply.status_code, problem["type"]) == (422, "/problems/path-infeasible")
    assert problem["path"] == "stops/pick/retreat" and problem["length"] == pytest.approx(1.8)
    assert len(problem["attempts"]) == 8 and all(
        0 < each["followed"] < 1 for each in problem["attempts"]
    )
    assert "shorten the line" in problem["detail"]


AROUND = {"about": [0.0, 0.0, 1.0]}
POINTS = [
    {"position": [0.45, -0.25, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
    {"position": [0.45, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
    {"position": [0.3, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
]


def with_path(**fields: Any) -> dict[str, Any]:
    """One stop with a path, lines to it and from it, and a dwell."""
    speed = {"min": 0.1, "max": 0.3}
    stop = {
        "name": "glue",
        "path": {"points": POINTS, "blend": 0.03, "speed": speed, "tolerance": AROUND} | fields,
        "dwell": 0.2,
        **LINES,
    }
    return a_cycle(stops=[stop])


@pytest.mark.long
def test_a_path_is_a_leg_of_its_own(client: TestClient) -> None:
    reply = client.post("/cycle", json=with_path())
    assert reply.status_code == 200, reply.text
    model_of(CycleAnswer).model_validate_json(reply.content)
    content = reply.json()
    legs = content["legs"]
    assert [(leg["kind"], leg["goal"]["stop"]) for leg in legs] == [
        ("move", "glue/approach"),
        ("line", "glue/entry"),
        ("path", "glue"),
        ("dwell", "glue"),
        ("line", "glue/retreat"),
        ("move", "start"),
    ]
    assert content["order"] == ["glue"] and legs[2]["lower_bound"] <= legs[2]["electrical"]
    path = client.get(legs[2]["answer"]).json()["answer"]
    worst = path["certificate"]["worst_ratio"]
    assert 0 < worst["path_position"] <= 1 and 0 < worst["path_speed"] <= 1 + 1e-6
    assert path["arm"]["limits"]["tcp_speed"] == 0.3
    program = client.post("/export/json", json={"answer": content})
    assert program.status_code == 200, program.text
    table = client.post(
        "/cycle", json=with_path(), headers={"accept": "text/csv"}
    ).text.splitlines()
    assert {row.split(",")[2] for row in table[1:]} == {"move", "line", "path", "dwell"}


@pytest.mark.parametrize(
    ("fields", "where"),
    [
        ({"points": POINTS[:1]}, ["path", "points"]),
        ({"points": [POINTS[0], POINTS[0], POINTS[1]]}, ["path", "points", 1]),
        ({"points": [POINTS[0], POINTS[1], POINTS[1]]}, ["path"]),
        ({"blend": 0.0}, ["path", "blend"]),
        ({"blend": 0.2}, ["path"]),
        ({"shape": "arc", "blend": 0.0, "points": POINTS[:2]}, ["path", "points"]),
        ({"speed": 0.0}, ["path", "speed"]),
        ({"speed": "fast"}, ["path", "speed"]),
        ({"speed": {"min": 0.3, "max": 0.31}}, ["path", "speed"]),
        ({"speed": {"min": 0.3, "ramp": 0.4}}, ["path", "speed", "ramp"]),
        ({"tolerance": {"position": 0.0}}, ["path", "tolerance", "position"]),
        ({"tolerance": {"about": [0.0, 0.0, 0.0]}}, ["path", "tolerance", "about"]),
    ],
    ids=[
        "one",
        "twice",
        "the end twice",
        "sharp",
        "too near",
        "no arc",
        "speed",
        "word",
        "no range",
        "all ramps",
        "tolerance",
        "axis",
    ],
)
def test_a_wrong_path_names_its_field(
    client: TestClient, fields: dict[str, Any], where: list[str]
) -> None:
    reply = client.post("/cycle", json=with_path(**fields))
    assert reply.status_code == 422
    assert reply.json()["errors"][0]["loc"] == ["body", "stops", 0, *where]


def test_a_path_is_divided_on_request(client: TestClient) -> None:
    """A joint comes to the end of its range on the way."""
    low, high = [-3.3, -6.2, -3.1, -6.2, -6.2, -6.2], [3.3, 6.2, 3.1, 6.2, 6.2, 6.2]
    points = [POINTS[0] | {"position": at} for at in ([0.45, -0.1, 0.2], [0.2, 0.5, 0.2])]
    path: dict[str, Any] = {"points": points, "split": True}
    stop = {"name": "glue", "path": path, "branch": {"shoulder": "left", "elbow": "up"}}
    content = a_cycle(
        stops=[stop], limits={"position": {"lower": low, "upper": high}}, collisions=False
    )
    reply = client.post("/cycle", json=content)
    assert reply.status_code == 200, reply.text
    answer = model_of(CycleAnswer).model_validate_json(reply.content)
    assert answer.order == ["glue/1", "glue"] and answer.status == "feasible"
    assert [(leg.kind, leg.goal.stop) for leg in answer.legs] == [
        ("move", "glue/1/entry"),
        ("path", "glue/1"),
        ("move", "glue/entry"),
        ("path", "glue"),
        ("move", "start"),
    ]
    (warning,) = answer.warnings
    assert warning.startswith("glue/1 is where the path is divided")
    path["split"] = False
    refusal = client.post("/cycle", json=content).json()
    assert refusal["type"] == "/problems/path-infeasible" and "split" in refusal["detail"]
    assert {each["reason"] for each in refusal["attempts"]} == {"outside_limits"}


@pytest.mark.parametrize(
    "fields", [{"target": down(0.4, 0.0, 0.2)}, {"path": None}], ids=["both", "neither"]
)
def test_a_stop_has_a_target_or_a_path(client: TestClient, fields: dict[str, Any]) -> None:
    content = with_path()
    content["stops"][0] |= fields
    reply = client.post("/cycle", json=content)
    assert reply.status_code == 422
    (error,) = reply.json()["errors"]
    assert error["loc"] == ["body", "stops", 0] and "exactly one" in error["msg"]


def test_a_fixed_speed_is_held_or_says_why_not(client: TestClient) -> None:
    def bead(speed: float) -> dict[str, Any]:
        path = {"points": POINTS[:2], "speed": {"min": speed, "max": speed}}
        only = {"shoulder": "right", "elbow": "up", "wrist": "flip"}
        return a_cycle(stops=[{"name": "bead", "path": path, "branch": only}], closed=False)

    reply = client.post("/cycle", json=bead(0.1))
    assert reply.status_code == 200, reply.text
    # the largest deviation, over a thousandth of the speed
    assert 0 < reply.json()["certificate"]["worst_ratio"]["path_speed"] <= 1
    fast = client.post("/cycle", json=bead(0.9)).json()
    assert fast["type"] == "/problems/no-sequence" and "lower speed" in fast["detail"]
