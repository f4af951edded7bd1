"""`joulepath rename`, by a service in this process."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from starlette.testclient import TestClient

from joulepath.app.cli.rename import KINDS
from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.models.registry import load_robot
from tests.app.cli.console import Here
from tests.app.job_clients import evaluation
from tests.app.requests import move
from tests.identification_logs import csv_of, recorded, truth_of

UNKNOWN = "9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"
ROBOT = load_robot("ur5e")
pytestmark = pytest.mark.usefixtures("service")


def log(client: TestClient) -> str:
    body = csv_of(recorded(ROBOT, truth_of(ROBOT), moves=2))
    sent = client.post("/logs", content=body, headers={"Content-Type": "text/csv"})
    return str(sent.json()["id"])


def posted(client: TestClient, path: str, body: object) -> str:
    return str(client.post(path, json=body).json()["id"])


MADE: dict[str, Callable[[TestClient], str]] = {
    "answers": lambda client: posted(client, "/optimize", move()),
    "jobs": lambda client: posted(client, "/jobs", {"requests": [evaluation()]}),
    "studies": lambda client: posted(client, "/studies", {"name": "A", "threshold": 60.0}),
    "logs": log,
    "robots": lambda client: str(client.put("/robots/lift", json=ARM).json()["name"]),
    "identifications": lambda client: posted(client, "/identifications", {"logs": [log(client)]}),
}


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_is_kept_has_another_name(here: Here, client: TestClient, kind: str) -> None:
    path = f"/{kind}/{(id := MADE[kind](client))}"
    field = "title" if kind == "robots" else "name"
    assert here.run("rename", kind, id, "Lift, cell 4") == (0, b"", b"")
    assert client.get(path).json()[field] == "Lift, cell 4"
    taken_away = here.run("rename", kind, id)[0]
    kept = kind == "studies"
    assert taken_away == (2 if kept else 0)
    without = {"studies": "Lift, cell 4", "robots": id}.get(kind)
    assert client.get(path).json()[field] == without
    # another test compares the service's robots with those that come with the library
    assert client.delete(path).status_code == 204


def test_what_is_refused(here: Here) -> None:
    code, problem = here.problem("rename", "jobs", UNKNOWN, "Lift")
    assert (code, problem["type"]) == (1, "/problems/unknown-job")
    code, problem = here.problem("rename", "jobs", UNKNOWN, "")
    assert (code, problem["type"]) == (2, "/problems/invalid-request")
    assert here.run("rename", "cells", UNKNOWN, "Lift")[0] == 2
