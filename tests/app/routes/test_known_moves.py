"""Cycles of one cell share moves: known moves are found again, with the same answers."""

from __future__ import annotations

from typing import Any

import orjson
from starlette.testclient import TestClient

from tests.app.job_clients import ended
from tests.app.requests import HOME, NEAR

KNOWN = {"Cache-Control": "max-age=60"}
FAR = [0.6, *NEAR[1:]]


def a_cycle(mass: float, *stops: list[float], **fields: Any) -> dict[str, Any]:
    payload = {"mass": mass, "com": [0.0, 0.0, 0.05]}
    own = {"start": {"q": HOME}, "stops": [{"target": {"q": q}} for q in stops]}
    return own | {"windings": False, "payload": payload, "robot": "ur5e"} | fields


def sent(client: TestClient, body: Any, **headers: str) -> Any:
    answer = client.post("/cycle", json=body, headers=KNOWN | headers)
    assert answer.status_code == 200, answer.text
    return answer.json()


def solves(client: TestClient, answer: Any) -> list[int]:
    """Number of solved nonlinear programs of each move."""
    moves = [
        client.get(leg["answer"]).json()["answer"]
        for leg in answer["legs"]
        if leg["kind"] == "move"
    ]
    return [move["solver"]["nlp_solves"] for move in moves]


def without_times(answer: Any) -> Any:
    legs = [
        {name: value for name, value in leg.items() if name != "answer"} for leg in answer["legs"]
    ]
    dropped = ("request", "id", "answer", "search")
    return {name: value for name, value in answer.items() if name not in dropped} | {"legs": legs}


def test_a_cycle_of_which_one_stop_changed_solves_only_the_moves_to_and_from_it(
    client: TestClient,
) -> None:
    first = sent(client, a_cycle(0.111, NEAR, FAR))
    assert all(solves(client, first))
    again = sent(client, a_cycle(0.111, NEAR, FAR))
    assert not any(solves(client, again))
    assert without_times(again) == without_times(first)
    other = [0.7, *NEAR[1:]]
    edited = sent(client, a_cycle(0.111, NEAR, other))
    assert list(map(bool, solves(client, edited))) == [False, True, True]
    fresh = sent(client, a_cycle(0.111, NEAR, other), **{"Cache-Control": "no-cache"})
    assert all(solves(client, fresh))
    assert without_times(edited) == without_times(fresh)


def test_cycles_of_jobs_share_them_with_those_that_are_answered_at_once(client: TestClient) -> None:
    sent(client, a_cycle(0.114, NEAR, FAR))
    job = client.post("/jobs", json={"requests": [{"cycle": a_cycle(0.114, NEAR)}]}, headers=KNOWN)
    assert ended(client, job.headers["location"])["state"] == "done"
    (line,) = client.get(f"{job.headers['location']}/results").text.splitlines()
    # the move home differs from the move out of the second stop
    assert list(map(bool, solves(client, orjson.loads(line)["result"]))) == [False, True]
    assert not any(solves(client, sent(client, a_cycle(0.114, NEAR))))
