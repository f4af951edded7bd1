"""`joulepath jobs`, by a service in this process."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.app.cli.console import Here
from tests.app.job_clients import evaluation, optimization

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
