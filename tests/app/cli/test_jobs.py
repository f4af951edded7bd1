"""`joulepath jobs`, `studies` and `rename`, by a service in this process."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from joulepath.app.cli.rename import KINDS
from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.optimizer.problem.robots import load_robot
from tests.app.cli.console import Here
from tests.app.job_clients import evaluation, optimization
from tests.app.requests import move
from tests.identification_logs import csv_of, recorded, truth_of

UNKNOWN = "9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"


def sent(here: Here, *requests: object, waits: bool = True) -> tuple[int, str]:
    """Exit code, and the id of a new job."""
    body = json.dumps({"requests": requests, "name": "moves"})
    code, out, _ = here.run("jobs", "send", "-", *(["--wait"] if waits else []), stdin=body)
    return code, out.decode().strip()


@pytest.mark.usefixtures("service")
def test_a_job_from_begin_to_end(here: Here, tmp_path: Path) -> None:
    code, job = sent(here, evaluation(), evaluation(2.0))
    assert code == 0
    listed = here.run("jobs")[1].decode()
    (row,) = (line for line in listed.splitlines() if line.startswith(job))
    assert row.split()[1:4] == ["moves", "done", "100%"]
    assert json.loads(here.run("jobs", "show", job)[1])["counts"]["done"] == 2
    lines = here.run("jobs", "results", job)[1].splitlines()
    assert [json.loads(line)["index"] for line in lines] == [0, 1]
    table = tmp_path / "table.csv"
    given = ("jobs", "results", job, "--format", "csv", "--output", str(table))
    assert here.run(*given) == (0, b"", b"")
    assert len(table.read_text().splitlines()) == 3
    assert b"done" in here.run("jobs", "retry", job)[1]
    assert here.run("jobs", "delete", job) == (0, b"", b"")
    code, problem = here.problem("jobs", "show", job)
    assert (code, problem["type"]) == (1, "/problems/unknown-job")


@pytest.mark.usefixtures("service")
def test_a_failed_request_is_an_exit_code(here: Here) -> None:
    code, job = sent(here, optimization(limits={"torque": 1.0}))
    assert code == 1
    assert here.run("jobs", "wait", job)[0] == 1
    code, problem = here.problem("jobs", "cancel", job)
    assert (code, problem["type"]) == (1, "/problems/job-not-cancellable")


@pytest.mark.usefixtures("service")
@pytest.mark.parametrize("body", ["", "[]", "{}", '{"name": "no requests"}'])
def test_a_file_without_a_job_is_wrong_usage(here: Here, body: str) -> None:
    code, out, err = here.run("jobs", "send", "-", stdin=body)
    assert (code, out) == (2, b"") and b"an object with `requests`" in err


@pytest.mark.usefixtures("service")
def test_a_malformed_request_is_a_problem(here: Here) -> None:
    body = json.dumps({"requests": [{"optimize": {"colour": "red"}}]})
    code, problem = here.problem("jobs", "send", "-", stdin=body)
    assert (code, problem["type"]) == (2, "/problems/invalid-request")


def test_no_service(here: Here) -> None:
    code, out, err = here.run("jobs", "--url", "http://127.0.0.1:1", "show", UNKNOWN)
    assert (code, out) == (1, b"")
    assert json.loads(err)["title"] == "Service unreachable"


def test_a_key_that_cannot_be_sent_is_a_problem(here: Here) -> None:
    for command in ("jobs", "studies"):
        code, problem = here.problem(command, "--key", "k\u00e9y")
        assert (code, problem["type"]) == (1, "/problems/unauthenticated")


def begun(here: Here) -> str:
    """The id of a new study."""
    code, out, _ = here.run("studies", "begin", "--name", "Lift", "--threshold", "500")
    assert code == 0
    return out.decode().strip()


@pytest.mark.usefixtures("service")
def test_a_study_from_begin_to_end(here: Here) -> None:
    study = begun(here)
    first = json.loads(here.run("studies", "add", study, "-", stdin=json.dumps(move()))[1])
    step = json.dumps({"optimize": move(duration={"min": 3.0, "max": 3.0})})
    second = json.loads(here.run("studies", "add", study, "-", stdin=step)[1])
    assert (first["number"], second["number"]) == (1, 2)
    assert second["change_from_last"] == pytest.approx(second["energy"] - first["energy"])
    assert second["change_from_last"] > 0
    (row,) = (
        line for line in here.run("studies")[1].decode().splitlines() if line.startswith(study)
    )
    assert row.split()[1:] == [
        *("Lift", "ur5e", "2"),
        *(f"{each['energy']:.1f}" for each in (second, first)),
        *("500.0", "yes"),
    ]
    shown = json.loads(here.run("studies", "show", study)[1])
    assert [each["energy"] for each in shown["history"]] == [first["energy"], second["energy"]]
    table = here.run("studies", "show", study, "--format", "csv")[1].decode()
    assert [row["iteration"] for row in csv.DictReader(io.StringIO(table))] == ["1", "2"]
    found = json.loads(here.run("studies", "suggest", study)[1])
    assert found["study"] == study and found["base"]["number"] == 1
    assert here.run("studies", "delete", study) == (0, b"", b"")
    code, problem = here.problem("studies", "show", study)
    assert (code, problem["type"]) == (1, "/problems/unknown-study")


@pytest.mark.usefixtures("service")
def test_studies_that_are_refused(here: Here) -> None:
    code, problem = here.problem("studies", "add", begun(here), "-", stdin=json.dumps({"a": 1}))
    assert (code, problem["type"]) == (2, "/problems/invalid-request")
    code, problem = here.problem("studies", "suggest", UNKNOWN)
    assert (code, problem["type"]) == (1, "/problems/unknown-study")
    assert here.run("studies", "begin", "--name", "no threshold")[0] == 2


ROBOT = load_robot("ur5e")


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


@pytest.mark.usefixtures("service")
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
    # another test compares the service's robots with the robots of the library
    assert client.delete(path).status_code == 204


@pytest.mark.usefixtures("service")
def test_names_that_are_refused(here: Here) -> None:
    code, problem = here.problem("rename", "jobs", UNKNOWN, "Lift")
    assert (code, problem["type"]) == (1, "/problems/unknown-job")
    code, problem = here.problem("rename", "jobs", UNKNOWN, "")
    assert (code, problem["type"]) == (2, "/problems/invalid-request")
    assert here.run("rename", "cells", UNKNOWN, "Lift")[0] == 2
