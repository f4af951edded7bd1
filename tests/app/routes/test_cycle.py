"""POST /cycle: the layout of the contract, answers by reference, and refusals."""

from __future__ import annotations

import csv
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.shared.parameters import deadline_of
from joulepath.app.convert.warnings import NO_DEFAULT_MOTION
from tests.app.requests import HOME, PATIENT

# relative: sums of the same numbers in another order
ROUNDING = 1e-9
# relative: optima of the same moves from initial guesses with different rounding
SAME_MOTION = 1e-6
REST: dict[str, Any] = {"target": {"q": HOME}}
PART = {"mass": 2.0, "com": [0.0, 0.0, 0.1]}


def down(x: float, y: float, z: float) -> dict[str, Any]:
    return {"pose": {"position": [x, y, z], "quaternion": [0.0, 1.0, 0.0, 0.0]}}


def a_cycle(**fields: Any) -> dict[str, Any]:
    """Two stops; a part is carried from the first to the second."""
    stops = [
        {"name": "pick", "target": down(0.45, -0.25, 0.2), "dwell": 0.5, "payload": PART},
        {"name": "place", "target": down(0.1, 0.5, 0.25), "payload": None},
    ]
    return {"start": {"q": HOME}, "stops": stops, "windings": False, **PATIENT, **fields}


def answered(client: TestClient, asked: dict[str, Any]) -> dict[str, Any]:
    """The answer to a cycle, checked against its schema."""
    reply = client.post("/cycle", json=asked)
    assert reply.status_code == 200, reply.text
    model_of(CycleAnswer).model_validate_json(reply.content)
    return reply.json()


@pytest.fixture(scope="module")
def answer(client: TestClient) -> dict[str, Any]:
    return answered(client, a_cycle())


@pytest.fixture(scope="module")
def stops(answer: dict[str, Any]) -> list[dict[str, Any]]:
    """The stops at the configurations of the answer: a quarter of the time to search among all."""
    pick, place = (answer["legs"][k]["goal"]["q"] for k in (0, 2))
    first, second = a_cycle()["stops"]
    return [first | {"target": {"q": pick}}, second | {"target": {"q": place}}]


def test_the_cycle_is_kept(client: TestClient, answer: dict[str, Any]) -> None:
    again = client.get(answer["answer"]).json()
    assert (again["kind"], again["answer"]) == ("cycle", answer)
    exported = client.post("/export/csv", json={"answer": answer["answer"]})
    assert exported.status_code == 200, exported.text
    table = list(csv.reader(exported.text.splitlines()))
    assert float(table[-1][0]) == pytest.approx(answer["duration"], rel=1e-3)


def test_legs_are_in_the_order_of_time(answer: dict[str, Any]) -> None:
    kinds = [(leg["kind"], leg["start"]["stop"], leg["goal"]["stop"]) for leg in answer["legs"]]
    assert kinds == [
        ("move", "start", "pick"),
        ("dwell", "pick", "pick"),
        ("move", "pick", "place"),
        ("move", "place", "start"),
    ]
    t = 0.0
    for leg in answer["legs"]:
        assert leg["t0"] == pytest.approx(t)
        t += leg["duration"]
    assert answer["duration"] == pytest.approx(t)
    assert [leg["payload_mass"] for leg in answer["legs"]] == [0.0, 2.0, 2.0, 0.0]
    for before, after in zip(answer["legs"], answer["legs"][1:], strict=False):
        assert before["goal"]["q"] == after["start"]["q"]
    assert answer["legs"][-1]["goal"]["q"] == HOME


def test_energies_add_up(answer: dict[str, Any]) -> None:
    energy, legs = answer["energy"], answer["legs"]
    for part in ("electrical", "mechanical"):
        assert energy[part]["total"] == pytest.approx(sum(leg[part] for leg in legs), rel=ROUNDING)
    assert energy["electrical"]["dwell"] == pytest.approx(
        answer["legs"][1]["electrical"], rel=ROUNDING
    )
    assert energy["lower_bound"] <= sum(leg["lower_bound"] for leg in answer["legs"]) * (
        1 + ROUNDING
    )
    assert energy["optimality_gap"] == pytest.approx(
        energy["electrical"]["total"] / energy["lower_bound"] - 1
    )
    for each in answer["baselines"]:
        assert (each["saving"] is None) == (not each["within_limits"])
        if each["saving"] is not None and each["duration"] == answer["duration"]:
            own = 1 - energy["electrical"]["total"] / each["electrical"]
            assert each["saving"] == pytest.approx(own, abs=ROUNDING)
    assert (
        answer["certificate"]["joins"] < ROUNDING
        and max(answer["certificate"]["worst_ratio"].values()) <= 1 + 1e-6
    )


def test_every_move_refers_to_its_answer(answer: dict[str, Any], client: TestClient) -> None:
    clearances = []
    for leg in answer["legs"]:
        if leg["kind"] == "dwell":
            assert leg["answer"] is None
            continue
        kept = client.get(leg["answer"]).json()
        assert kept["kind"] == "optimize"
        own = model_of(OptimizeAnswer).model_validate(kept["answer"]).model_dump(exclude_unset=True)
        assert (
            own["energy"]["electrical"]["total"] == leg["electrical"]
            and own["duration"] == leg["duration"]
        )
        assert own["branch"]["goal"]["q"] == leg["goal"]["q"]
        clearances.append(own["certificate"]["clearance"]["min_clearance"])
    nearest = answer["certificate"]["clearance"]
    assert (
        nearest["min_clearance"] == min(clearances)
        and answer["legs"][nearest["leg"]]["kind"] == "move"
    )


def test_a_payload_that_is_left_out_stays_and_null_puts_it_down(
    client: TestClient, stops: list[dict[str, Any]]
) -> None:
    carried = client.post(
        "/cycle", json=a_cycle(stops=[stops[0], {"target": stops[1]["target"]}], closed=False)
    ).json()
    assert [leg["payload_mass"] for leg in carried["legs"]] == [0.0, 2.0, 2.0]
    assert carried["legs"][-1]["goal"]["stop"] == "2"  # a stop without a name has its number
    put_down = client.post("/cycle", json=a_cycle(payload=PART, stops=[stops[1]])).json()
    assert [leg["payload_mass"] for leg in put_down["legs"]] == [2.0, 0.0]


REFUSED: dict[str, tuple[str, list[Any] | None, dict[str, Any]]] = {
    "no stops": ("invalid-request", ["body", "stops"], {"stops": []}),
    "unknown field": (
        "invalid-request",
        ["body", "stops", 0],
        {"stops": [{"target": {"q": HOME}, "speed": 1}]},
    ),
    "same names": (
        "invalid-request",
        ["body", "stops", 1, "name"],
        {"stops": [{"name": "a", "target": {"q": HOME}}, {"name": "A", "target": {"q": HOME}}]},
    ),
    "number of another": (
        "invalid-request",
        ["body", "stops", 1, "name"],
        {"stops": [{"name": "2", "target": {"q": HOME}}, {"target": {"q": HOME}}]},
    ),
    "joints": (
        "invalid-request",
        ["body", "stops", 0, "target", "q"],
        {"stops": [{"target": {"q": [0.0]}}]},
    ),
    "free orientation of one of several": (
        "invalid-request",
        ["body", "stops", 0, "target"],
        {
            "stops": [
                {
                    "target": {
                        "any_of": [
                            {"pose": {"position": [0.4, 0.0, 0.3], "orientation": "free"}},
                            {"q": HOME},
                        ]
                    }
                }
            ]
        },
    ),
    "free orientation at the start": (
        "invalid-request",
        ["body", "start"],
        {"start": {"pose": {"position": [0.4, 0.0, 0.3], "orientation": "free"}}},
    ),
    "overloaded": (
        "invalid-request",
        ["body", "stops", 0, "payload", "mass"],
        {"stops": [{"target": {"q": HOME}, "payload": {"mass": 50.0, "com": [0, 0, 0]}}]},
    ),
    "beyond a joint": ("outside-limits", None, {"stops": [{"target": {"q": [9.0, *HOME[1:]]}}]}),
    "out of reach": ("unreachable-pose", None, {"stops": [{"target": down(2.0, 0.0, 0.2)}]}),
    "in the ground": (
        "stop-in-collision",
        None,
        {
            "scene": {
                "obstacles": [
                    {
                        "name": "block",
                        "shape": "box",
                        "size": [0.3, 0.3, 0.3],
                        "pose": {"position": [0.45, -0.25, 0.2], "rotvec": [0, 0, 0]},
                    }
                ]
            }
        },
    ),
    "deadline": ("invalid-request", ["body", "deadline"], {"deadline": 1e5}),
    "too many stops": ("invalid-request", ["body", "stops"], {"stops": [REST] * 257}),
    "samples of many stops": (
        "invalid-request",
        ["body", "sample_period"],
        {"stops": [REST] * 101, "sample_period": 1e-4},
    ),
    "no time": ("invalid-request", ["body", "time"], {"time": 0.0}),
    "turned cycle": ("invalid-request", ["body", "time"], {"time": {"min": 9.0, "max": 8.0}}),
    "text": ("invalid-request", ["body", "time"], {"time": "long"}),
    "work without a time": ("invalid-request", ["body", "time"], {"objective": "mechanical"}),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_wrong_is_named(name: str, client: TestClient) -> None:
    kind, loc, fields = REFUSED[name]
    reply = client.post("/cycle", json=a_cycle(**fields))
    content = reply.json()
    assert (reply.status_code, content["type"]) == (422, f"/problems/{kind}"), content
    if loc is not None:
        assert content["errors"][0]["loc"][: len(loc)] == loc
    if kind in ("unreachable-pose", "stop-in-collision"):
        assert content["target"].startswith("stops/")


@pytest.mark.parametrize(
    ("count", "most", "allowed"), [(100, 600.0, 60.0), (101, 600.0, 120.0), (256, 90.0, 90.0)]
)
def test_many_stops_have_more_time_by_default_where_the_operator_allows_it(
    count: int, most: float, allowed: float
) -> None:
    asked = CycleRequest.model_validate({"start": {"q": HOME}, "stops": [REST] * count})
    assert deadline_of(asked, most) == allowed
    given = CycleRequest.model_validate(
        {"start": {"q": HOME}, "stops": [REST] * count, "deadline": 60.0}
    )
    assert deadline_of(given, most) == 60.0


def test_no_time_is_a_deadline_exceeded(client: TestClient) -> None:
    reply = client.post("/cycle", json=a_cycle(deadline=0.002))
    assert (reply.status_code, reply.json()["type"]) == (504, "/problems/deadline-exceeded")


def test_a_redundant_arm_warns_once_of_what_holds_for_the_whole_cycle(client: TestClient) -> None:
    q = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8]
    stops = [{"target": {"q": [0.4, *q[1:]]}}, {"target": {"q": [0.4, -0.3, *q[2:]]}}]
    answer = client.post(
        "/cycle", json={"robot": "panda", "start": {"q": q}, "stops": stops, **PATIENT}
    ).json()
    assert answer["warnings"] == [NO_DEFAULT_MOTION]
    names = [each["name"] for each in answer["baselines"]]
    assert names == ["move_by_move", "ruckig_slowed", "straight"]


def test_the_moves_repeat_the_scene_in_its_frame(client: TestClient) -> None:
    """A computation with a move's arm meets the obstacles at the same places as the cycle."""
    pose = {"position": [0.5, 0.0, 0.1], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    scene = {
        "frame": "base_link",
        "obstacles": [{"name": "box", "shape": "box", "size": [0.1, 0.1, 0.2], "pose": pose}],
    }
    body = {
        "start": {"q": HOME},
        "stops": [{"target": down(0.4, -0.35, 0.3)}],
        "scene": scene,
        **PATIENT,
    }
    legs = client.post("/cycle", json=body | {"windings": False}).json()["legs"]
    arms = [client.get(leg["answer"]).json()["answer"]["arm"] for leg in legs]
    assert [arm["scene"]["frame"] for arm in arms] == ["base_link"] * len(legs)


def test_a_cycle_in_a_given_time_waits_on_its_brakes(
    client: TestClient, answer: dict[str, Any], stops: list[dict[str, Any]]
) -> None:
    time, hold = (
        2.5 * answer["duration"],
        {"hold": "brakes", "brake_delay": 0.2, "brake_power": 2.0},
    )
    found = client.post("/cycle", json=a_cycle(stops=stops, time=time, hold=hold)).json()
    assert found["duration"] == pytest.approx(time) and found["price_of_time"] < 0
    (wait,) = (leg for leg in found["legs"] if leg["kind"] == "wait")
    assert wait["start"] == wait["goal"] and wait["answer"] is None
    legs = found["legs"]
    assert found["energy"]["electrical"]["total"] == pytest.approx(
        sum(leg["electrical"] for leg in legs), rel=ROUNDING
    )
    assert legs[-1]["t0"] + legs[-1]["duration"] == pytest.approx(time)
    assert (
        "fastest_then_wait" in {each["name"] for each in found["baselines"]}
        and found["warnings"] == []
    )
    at_most = client.post("/cycle", json=a_cycle(stops=stops, time={"max": time})).json()
    assert at_most["duration"] == pytest.approx(answer["duration"], rel=SAME_MOTION)
    assert at_most["price_of_time"] == 0


def test_a_cycle_that_cannot_be_so_fast_says_how_fast_it_can_be(
    client: TestClient, answer: dict[str, Any], stops: list[dict[str, Any]]
) -> None:
    reply = client.post("/cycle", json=a_cycle(stops=stops, time=1.0))
    problem = reply.json()
    assert (reply.status_code, problem["type"], problem["dwells"]) == (
        422,
        "/problems/cycle-too-short",
        0.5,
    )
    assert 1.0 < problem["shortest"] <= answer["duration"]


def test_a_free_order_is_told(client: TestClient, stops: list[dict[str, Any]]) -> None:
    look = {"name": "look", "target": {"q": [HOME[0] + 0.5, *HOME[1:]]}}
    content = a_cycle(stops=[*stops, look], order="free", together=[["pick", "place"]])
    reply = client.post("/cycle", json=content)
    assert reply.status_code == 200, reply.text
    order = model_of(CycleAnswer).model_validate_json(reply.content).order
    assert (
        sorted(order) == ["look", "pick", "place"]
        and order.index("place") == order.index("pick") + 1
    )


@pytest.mark.parametrize(
    ("fields", "loc"),
    [
        ({"before": [["pick", "place"]]}, ["body"]),
        ({"order": "free", "before": [["pick", "nowhere"]]}, ["body", "before", 0]),
        ({"order": "free"}, ["body", "together"]),
        ({"wait": "nowhere"}, ["body", "wait"]),
    ],
)
def test_an_order_that_cannot_be_names_its_field(
    client: TestClient, fields: dict[str, Any], loc: list[Any]
) -> None:
    reply = client.post("/cycle", json=a_cycle(**fields))
    assert reply.status_code == 422 and reply.json()["errors"][0]["loc"] == loc


def test_an_order_that_contradicts_itself_says_which_stops_do(client: TestClient) -> None:
    reply = client.post(
        "/cycle",
        json=a_cycle(order="free", before=[["place", "pick"]], together=[["pick", "place"]]),
    )
    problem = reply.json()
    assert (reply.status_code, problem["type"]) == (422, "/problems/contradictory-order")
    assert problem["names"] == ["place", "pick"] and "leave out" in problem["detail"]


def test_the_cycle_as_a_table(
    client: TestClient, answer: dict[str, Any], stops: list[dict[str, Any]]
) -> None:
    reply = client.post("/cycle", json=a_cycle(stops=stops), headers={"Accept": "text/csv"})
    assert reply.status_code == 200 and reply.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(reply.text.splitlines()))
    times, power = (np.array([float(row[name]) for row in rows]) for name in ("t", "power"))
    assert (np.diff(times) >= 0).all() and times[-1] == pytest.approx(answer["duration"])
    # the trapezoidal rule over samples of 8 ms
    assert np.trapezoid(power, times) == pytest.approx(
        answer["energy"]["electrical"]["total"], rel=5e-3
    )
    assert [float(rows[-1][f"q{k + 1}"]) for k in range(6)] == pytest.approx(HOME)
    assert {(row["leg"], row["kind"]) for row in rows} == {
        (str(k), leg["kind"]) for k, leg in enumerate(answer["legs"])
    }


@pytest.mark.long
def test_a_storage_is_charged_from_leg_to_leg(client: TestClient) -> None:
    bus = {"mode": "storage", "capacity": 30.0, "power": 500.0, "efficiency": 0.9}
    content = answered(client, a_cycle(bus=bus))
    legs, use = content["legs"], content["energy"]["storage"]
    assert legs[-1]["charge"] == pytest.approx(use["final"]) == pytest.approx(use["initial"])
    assert {each["name"] for each in content["baselines"]} == {"without_storage", "move_by_move"}
    charge = use["initial"]
    for leg in legs:
        if leg["answer"]:
            own = client.get(leg["answer"]).json()["answer"]
            assert own["energy"]["storage"]["initial"] == pytest.approx(charge)
            assert own["arm"]["bus"]["initial"] == pytest.approx(charge)
        charge = leg["charge"]
