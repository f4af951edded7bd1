"""Names of stored things: given, found by a search, taken away, and refused alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from uuid import uuid4

import pytest
from starlette.testclient import TestClient

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import (
    UnknownAnswer,
    UnknownIdentification,
    UnknownJob,
    UnknownLog,
    UnknownStudy,
)
from joulepath.app.schemas.examples.bodies import LOG_EXAMPLES
from joulepath.optimizer.exceptions import DeclaredError
from tests.app.job_clients import evaluation, sent
from tests.app.problems import checked
from tests.app.requests import move
from tests.app.routes.test_problems import refused

CSV = {"Content-Type": "text/csv"}


def add_log(client: TestClient) -> str:
    body = LOG_EXAMPLES["positions"]["value"]
    return str(client.post("/logs", content=body, headers=CSV).json()["id"])


def add_identification(client: TestClient) -> str:
    """A log without currents, so the identification fails, but it is kept with its name."""
    answer = client.post("/identifications", json={"logs": [add_log(client)]})
    return str(answer.json()["id"])


def add_study(client: TestClient) -> str:
    answer = client.post("/studies", json={"name": "A study", "threshold": 1.0})
    return answer.headers["location"].rpartition("/")[2]


ADD: dict[str, tuple[Callable[[TestClient], str], type[DeclaredError]]] = {
    "answers": (lambda client: client.post("/optimize", json=move()).json()["id"], UnknownAnswer),
    "jobs": (lambda client: sent(client, [evaluation()]).rpartition("/")[2], UnknownJob),
    "studies": (add_study, UnknownStudy),
    "logs": (add_log, UnknownLog),
    "identifications": (add_identification, UnknownIdentification),
}


@pytest.mark.parametrize("things", ADD)
def test_names_are_given_found_and_refused(recorded: TestClient, things: str) -> None:
    add, unknown = ADD[things]
    id, other = add(recorded), add(recorded)
    name = f"50% tray {uuid4().hex[:6]}"

    def found(**query: Any) -> list[str]:
        answer = recorded.get(f"/{things}", params={"limit": 200, **query})
        assert answer.status_code == 200, answer.text
        return [each["id"] for each in answer.json()[things]]

    renamed = recorded.patch(f"/{things}/{id}", json={"name": name})
    assert renamed.status_code == 200, renamed.text
    assert renamed.json()["name"] == recorded.get(f"/{things}/{id}").json()["name"] == name
    assert found(search=name.upper()) == [id]
    assert found(search="5_% tray") == [], "signs of patterns are letters"
    assert {id, other} <= set(found())
    for body in ({"name": ""}, {"name": "\u200b"}, {"name": 3}, {}, {"name": "x", "owner": "me"}):
        refused(recorded.patch(f"/{things}/{id}", json=body), InvalidRequest)
    refused(recorded.get(f"/{things}", params={"search": ""}), InvalidRequest)
    for nothing in (str(uuid4()), "no-id"):
        refused(recorded.patch(f"/{things}/{nothing}", json={"name": "x"}), unknown)
    if things == "studies":
        refused(recorded.patch(f"/studies/{id}", json={"name": None}), InvalidRequest)
    else:
        assert recorded.patch(f"/{things}/{id}", json={"name": None}).json()["name"] is None
        assert found(search=name) == []
    assert recorded.delete(f"/{things}/{id}").status_code == 204
    checked(unknown, recorded.get(f"/{things}/{id}").content)
    assert recorded.get(f"/{things}/{other}").status_code == 200


@pytest.mark.parametrize("things", ["logs", "studies"])
def test_a_robot_is_searched_for(recorded: TestClient, things: str) -> None:
    id = ADD[things][0](recorded)
    listed = recorded.get(f"/{things}", params={"limit": 200, "search": "UR5e"}).json()[things]
    assert id in {each["id"] for each in listed}
    assert recorded.get(f"/{things}", params={"search": "ur10"}).json()[things] == []


@pytest.mark.parametrize("things", ADD)
def test_pages_of_a_search_hold_everything_once(recorded: TestClient, things: str) -> None:
    """The newest comes first."""
    name, ids = f"Shift {uuid4().hex[:6]}", [ADD[things][0](recorded) for _ in range(4)]
    for id in ids:
        recorded.patch(f"/{things}/{id}", json={"name": name})
    query: dict[str, Any] = {"limit": 2, "search": name}
    first = recorded.get(f"/{things}", params=query).json()
    rest = recorded.get(f"/{things}", params=query | {"after": first["next"]}).json()
    assert [[each["id"] for each in page[things]] for page in (first, rest)] == [
        ids[:1:-1],
        ids[1::-1],
    ]
    assert rest["next"] is None


def test_identifications_are_jobs_that_a_list_of_jobs_may_leave_out(recorded: TestClient) -> None:
    identification, job = add_identification(recorded), ADD["jobs"][0](recorded)
    recorded.patch(f"/identifications/{identification}", json={"name": "Arm 3"})
    assert recorded.get(f"/jobs/{identification}").json()["name"] == "Arm 3"

    def listed(**query: Any) -> set[str]:
        return {each["id"] for each in recorded.get("/jobs", params=query).json()["jobs"]}

    assert {identification, job} <= listed(limit=200)
    without = listed(limit=200, identifications="false")
    assert job in without and identification not in without
    # a job other than an identification is not named or deleted as one
    refused(recorded.patch(f"/identifications/{job}", json={"name": "x"}), UnknownIdentification)
    refused(recorded.delete(f"/identifications/{job}"), UnknownIdentification)
    assert recorded.get(f"/jobs/{job}").status_code == 200
