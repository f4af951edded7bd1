"""POST /advice: the energy of a change is the energy of the changed task, and no more is
claimed.
"""

from __future__ import annotations

from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.advice.task import AdviceAnswer
from joulepath.models.tools.registry import tool_figures
from tests.app.requests import HOME, NEAR, PATIENT, move

Json = dict[str, Any]
PART = {"mass": 2.0, "com": [0.0, 0.0, 0.05]}
CYCLE: Json = {
    "start": {"q": HOME},
    "stops": [
        {"name": "pick", "target": {"q": NEAR}, "payload": PART, "dwell": 0.6},
        {"name": "place", "target": {"q": [0.5, -1.3, 1.3, -1.5, -1.57, 0.2]}, "payload": None},
    ],
    **PATIENT,
}
CLOSE = 5e-3
"""Relative difference of the energies of two answers to the same request."""


def advised(client: TestClient, **body: Any) -> Json:
    answer = client.post("/advice", json=body)
    assert answer.status_code == 200, answer.text
    model_of(AdviceAnswer).model_validate_json(answer.content)
    return answer.json()


def energy(client: TestClient, path: str, body: Json) -> float:
    answer = client.post(path, json=body)
    assert answer.status_code == 200, answer.text
    return float(answer.json()["energy"]["electrical"]["total"])


def by_name(found: Json) -> dict[str, Json]:
    return {each["name"]: each for each in found["advice"]}


def test_a_move_is_advised_to_take_the_whole_time_and_to_brake(client: TestClient) -> None:
    asked = move(payload=PART)
    found = advised(client, optimize=asked, period=6.0)
    alone = client.post("/optimize", json=asked).json()
    assert found["home"] is None
    total = alone["energy"]["electrical"]["total"]
    assert found["energy"] - found["waiting"] == pytest.approx(total, rel=CLOSE)
    # the wait of the same motion, as counted by /optimize
    ends = {key: {"q": alone["branch"][key]["q"]} for key in ("start", "goal")}
    held = client.post(
        "/optimize",
        json=asked | ends | {"duration": alone["duration"], "dwell": {"time": 6.0}},
    ).json()
    assert found["waiting"] == pytest.approx(held["energy"]["electrical"]["dwell"], rel=CLOSE)
    changes = by_name(found)
    whole, brakes = changes["whole_cycle"], changes["brakes"]
    assert whole["request"] == asked | {"dwell": {"time": 6.0}, "duration": None}
    for each in (whole, brakes):
        own = energy(client, "/optimize", each["request"])
        assert each["energy"] == pytest.approx(own, rel=CLOSE)
        assert each["saving"] == pytest.approx(each["instead_of"] - each["energy"])
    assert whole["instead_of"] == found["energy"] and brakes["instead_of"] == whole["energy"]
    assert brakes["request"]["dwell"]["hold"] == "brakes"


def test_a_cycle_is_advised_on_its_way_home_and_its_stops(client: TestClient) -> None:
    found = advised(client, cycle=CYCLE)
    changes = by_name(found)
    assert found["waiting"] == 0
    without = changes["without_home"]
    assert without["request"]["start"] == CYCLE["stops"][-1]["target"]
    assert without["energy"] == pytest.approx(
        energy(client, "/cycle", without["request"]), rel=CLOSE
    )
    dwells = [stop.get("dwell") for stop in changes["shorter_stops"]["request"]["stops"]]
    assert dwells == [pytest.approx(0.5), 0.0]
    legs = client.post("/cycle", json=CYCLE).json()["legs"]
    home = sum(
        leg["electrical"]
        for leg in legs
        if leg["kind"] == "move" and "start" in (leg["start"]["stop"], leg["goal"]["stop"])
    )
    assert found["home"] == pytest.approx(home, rel=CLOSE)
    savings = [each["saving"] for each in found["advice"]]
    assert savings == sorted(savings, reverse=True) and min(savings) > 0


def test_the_rest_of_the_period_is_waited_after_a_cycle_with_a_time(client: TestClient) -> None:
    one = {"start": {"q": HOME}, "stops": [{"target": {"q": NEAR}}], **PATIENT}
    asked = one | {"time": {"max": 5.0}}
    kept = client.post("/cycle", json=asked).json()
    body = {"cycle": asked, "answer": kept["id"], "changes": []}
    short, long = (advised(client, **body, period=period)["waiting"] for period in (6.0, 8.0))
    rest = 6.0 - kept["duration"]
    assert 0 < short == pytest.approx(rest * (long - short) / 2.0)


def test_the_wait_after_an_open_cycle_is_without_what_it_put_down(client: TestClient) -> None:
    place = {"target": {"q": NEAR}, "payload": None, "dwell": 0.5}
    asked = {"start": {"q": HOME}, "payload": PART, "stops": [place], "closed": False, **PATIENT}
    kept = client.post("/cycle", json=asked).json()
    (dwell,) = (leg for leg in kept["legs"] if leg["kind"] == "dwell")
    found = advised(client, cycle=asked, answer=kept["id"], changes=[], period=6.0)
    held = found["waiting"] / (6.0 - kept["duration"])
    assert held == pytest.approx(dwell["electrical"] / dwell["duration"])


@pytest.mark.long
def test_the_way_home_is_needed_where_something_is_carried_there(client: TestClient) -> None:
    stops = [CYCLE["stops"][0], CYCLE["stops"][1] | {"payload": PART}]
    assert "without_home" not in by_name(advised(client, cycle=CYCLE | {"stops": stops}))
    at_home = [CYCLE["stops"][0], CYCLE["stops"][1] | {"target": CYCLE["start"]}]
    assert "without_home" not in by_name(advised(client, cycle=CYCLE | {"stops": at_home}))
    assert "without_home" not in by_name(advised(client, cycle=CYCLE | {"closed": False}))


def test_a_lighter_tool_has_half_of_the_mass(client: TestClient) -> None:
    asked = move(tool="robotiq_2f_85")
    lighter = by_name(advised(client, optimize=asked))["lighter_tool"]
    assert lighter["request"] is None
    tool = tool_figures("robotiq_2f_85")
    body = {"mass": tool["mass"]["value"] / 2, "com": tool["center_of_mass"]["value"]}
    inertia = [value / 2 for value in tool["inertia"]["value"]]
    tcp = {"position": tool["tcp"]["value"][:3], "rotvec": tool["tcp"]["value"][3:]}
    half = move(payload=body | {"inertia": inertia}, tcp=tcp)
    assert lighter["energy"] == pytest.approx(energy(client, "/optimize", half), rel=CLOSE)


@pytest.mark.long
def test_a_task_with_its_own_wait_or_another_objective_gets_no_wait(client: TestClient) -> None:
    own = advised(client, optimize=move(dwell={"time": 4.0}), period=9.0)
    assert own["waiting"] == 0 and set(by_name(own)) <= {"brakes"}
    work = advised(client, optimize=move(objective="mechanical", duration=2.0), period=6.0)
    assert work["waiting"] > 0 and work["advice"] == []


def test_advice_on_a_kept_answer_is_of_that_answer(client: TestClient) -> None:
    kept = client.post("/optimize", json=move()).json()
    found = advised(client, optimize=move(), answer=kept["id"])
    assert found["energy"] == kept["energy"]["electrical"]["total"]
    answer = client.post("/advice", json={"cycle": CYCLE, "answer": kept["id"]})
    assert answer.status_code == 422 and "another request" in answer.text
    before = client.get("/answers").json()["answers"][0]["id"]
    advised(client, optimize=move(), answer=kept["id"], period=5.0)
    assert client.get("/answers").json()["answers"][0]["id"] == before, "nothing is kept"


def test_a_long_deadline_of_the_motion_leaves_time_for_the_changes(client: TestClient) -> None:
    """The deadline of the motion may exceed the time for all changes, as in a request of a job."""
    found = advised(client, optimize=move(deadline=3000.0), period=6.0)
    assert {"whole_cycle", "brakes"} <= by_name(found).keys()


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/advice", {"optimize": move(deadline=3601.0)}),
        ("/report", {"optimize": move(deadline=3601.0)}),
        ("/whatif", {"optimize": move(deadline=3601.0), "changes": []}),
    ],
)
def test_a_deadline_beyond_all_limits_is_refused(
    recorded: TestClient, path: str, body: Json
) -> None:
    errors = recorded.post(path, json=body).json()["errors"]
    assert any(
        error["loc"] == ["body", "optimize"] and "at most 3600" in error["msg"] for error in errors
    )


@pytest.mark.parametrize("body", [{}, {"optimize": move(), "cycle": CYCLE}])
def test_other_bodies_are_refused(recorded: TestClient, body: Json) -> None:
    assert recorded.post("/advice", json=body).status_code == 422


@pytest.mark.parametrize("path", ["/advice", "/report"])
def test_an_error_of_the_motion_names_its_field(client: TestClient, path: str) -> None:
    answer = client.post(path, json={"optimize": move(limits={"velocity": [1.0]})})
    (error,) = answer.json()["errors"]
    assert error["loc"][:3] == ["body", "optimize", "limits"], error
