"""Jobs over HTTP: their life, their results, refusals."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath import DurationTooShort, InvalidRequest
from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.exceptions.queue import Busy
from joulepath.app.exceptions.stored import JobNotCancellable, KeyReused, UnknownAnswer, UnknownJob
from joulepath.app.exceptions.transport import BodyTooLarge
from joulepath.app.schemas.jobs import JobList
from tests.app.job_clients import ended, evaluation, optimization, parsed, sent
from tests.app.problems import checked
from tests.app.recorded import recorded_service
from tests.app.requests import HOME, NEAR, move
from tests.app.routes.test_problems import refused

ABSENT = "/jobs/5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7"
TOO_SHORT = {"optimize": move(duration=0.01)}


@pytest.fixture(scope="module")
def mixed(client: TestClient) -> tuple[str, dict[str, Any]]:
    """A job of every kind, after its end."""
    start, goal = {"q": HOME}, {"q": NEAR}
    requests = [
        optimization(),
        TOO_SHORT,
        evaluation(),
        {"pareto": move(points=2, method="time_scaling")},
        {"compare": move(methods=["time_scaling", "uniform_scaling"])},
        {
            "whatif": {
                "evaluate": evaluation()["evaluate"],
                "changes": [{"name": "x", "arm": {"link_mass_scale": 0.5}}],
            }
        },
        {
            "cycle": {
                "start": start,
                "stops": [{"target": goal}],
                "windings": False,
                "deadline": 100.0,
            }
        },
    ]
    path = sent(client, requests, name="Every kind ✓")
    return path, ended(client, path)


def test_every_kind_is_answered_as_by_its_endpoint(client: TestClient, mixed: Any) -> None:
    _, job = mixed
    assert (job["name"], job["state"], job["progress"], job["eta"]) == (
        "Every kind ✓",
        "done",
        1.0,
        None,
    )
    assert job["counts"] == {"waiting": 0, "running": 0, "done": 6, "failed": 1, "cancelled": 0}
    assert [each["index"] for each in job["requests"]] == list(range(7))
    kinds = ["optimize", "optimize", "evaluate", "pareto", "compare", "whatif", "cycle"]
    assert [each["kind"] for each in job["requests"]] == kinds
    for each in job["requests"]:
        assert (each["state"] == "failed") == (each["index"] == 1) == (each["answer"] is None)
        if each["answer"] is not None:
            kept = client.get(each["answer"]).json()
            assert kept["kind"] == each["kind"]
            assert kept["answer"]["request"] == f"{job['id']}.{each['index']}"
    alone = client.post("/optimize", json=optimization()["optimize"]).json()
    answer = client.get(job["requests"][0]["answer"]).json()["answer"]
    model_of(OptimizeAnswer).model_validate(answer)
    assert answer["trajectory"] == alone["trajectory"]
    assert job["requests"][0]["energy"] == alone["energy"]["electrical"]["total"]
    assert (job["requests"][0]["duration"], job["requests"][0]["status"]) == (
        alone["duration"],
        alone["status"],
    )
    assert job["requests"][2]["energy"] > 0 and job["requests"][6]["energy"] > 0
    assert job["requests"][3]["energy"] is None, "a front has several"


def test_a_failed_request_has_the_problem_of_its_endpoint(client: TestClient, mixed: Any) -> None:
    _, job = mixed
    problem = job["requests"][1]["problem"]
    checked(DurationTooShort, problem)
    alone = client.post("/optimize", json=TOO_SHORT["optimize"]).json()
    assert problem | {"instance": ""} == alone | {"instance": ""}


def test_answers_within_answers_are_kept(client: TestClient, mixed: Any) -> None:
    _, job = mixed
    front = client.get(job["requests"][3]["answer"]).json()["answer"]
    for point in front["points"]:
        assert client.get(point["answer"]).json()["kind"] == "optimize"
    changed = client.get(job["requests"][5]["answer"]).json()["answer"]
    assert client.get(changed["base"]["answer"]).json()["kind"] == "evaluate"


def test_requests_come_page_by_page(client: TestClient, mixed: Any) -> None:
    path, job = mixed
    after, found = -1, []
    while after is not None:
        page = client.get(f"{path}?limit=3&after={after}").json()
        found += page["requests"]
        after = page["next"]
    assert found == job["requests"]


def test_results_as_lines(client: TestClient, mixed: Any) -> None:
    path, job = mixed
    answer = client.get(f"{path}/results")
    assert answer.headers["content-type"].startswith("application/x-ndjson")
    lines = [json.loads(line) for line in answer.text.splitlines()]
    for line, each in zip(lines, job["requests"], strict=True):
        result = line.pop("result")
        assert line == each
        assert result == (
            None if each["answer"] is None else client.get(each["answer"]).json()["answer"]
        )


def test_results_as_a_table(client: TestClient, mixed: Any) -> None:
    path, job = mixed
    answer = client.get(f"{path}/results", headers={"Accept": "text/csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [int(row["index"]) for row in rows] == list(range(7))
    assert [row["problem"] for row in rows] == ["", "duration-too-short", "", "", "", "", ""]
    assert float(rows[0]["energy_J"]) == job["requests"][0]["energy"]
    assert [row["answer"] or None for row in rows] == [each["answer"] for each in job["requests"]]


def test_events_tell_the_whole_story_and_resume(client: TestClient, mixed: Any) -> None:
    path, _ = mixed
    found = list(parsed(iter(client.get(f"{path}/events").text.splitlines())))
    assert [event.number for event in found] == list(range(1, len(found) + 1))
    assert [event.data["state"] for event in found if event.name == "state"] == [
        "waiting",
        "running",
        "done",
    ]
    assert sorted(event.data["index"] for event in found if event.name == "request") == list(
        range(7)
    )
    assert found[-1].name == "end"
    for after in (0, 3, len(found) - 1, len(found), 10**8):
        rest = client.get(f"{path}/events", headers={"Last-Event-ID": str(after)})
        assert rest.status_code == (200 if after < len(found) else 204)
        assert list(parsed(iter(rest.text.splitlines()))) == found[after:]
    everything = client.get(
        f"{path}/events", headers={"Last-Event-ID": "no number"}
    ).text.splitlines()
    assert list(parsed(iter(everything))) == found


def test_jobs_are_listed_by_their_state(recorded: TestClient) -> None:
    path = sent(recorded, [evaluation()])
    ended(recorded, path)
    answer = recorded.get("/jobs", params={"state": "done", "limit": 1})
    (job,) = JobList.model_validate_json(answer.content).jobs
    assert path == f"/jobs/{job.id}"
    assert recorded.get("/jobs?state=cancelling").json() == {"jobs": [], "next": None}


def test_a_malformed_request_refuses_the_whole_job(recorded: TestClient) -> None:
    before = recorded.get("/jobs?limit=1").json()
    wrong: list[tuple[Any, list[Any]]] = [
        ({"requests": []}, ["requests"]),
        ({"requests": [evaluation()] * 10_001}, ["requests"]),
        ({"requests": [evaluation(), {}]}, ["requests", 1]),
        ({"requests": [evaluation(), evaluation() | optimization()]}, ["requests", 1]),
        ({"requests": [evaluation(), {"ik": {}}]}, ["requests", 1]),
        (
            {"requests": [evaluation(), evaluation(), evaluation(-1.0)]},
            ["requests", 2, "evaluate", "time_per_segment"],
        ),
        (
            {"requests": [evaluation(), optimization(deadline=3601.0)]},
            ["requests", 1, "optimize", "deadline"],
        ),
        ({"requests": [evaluation()], "keep_going": "no"}, ["keep_going"]),
        ({"requests": [evaluation()], "name": "\n"}, ["name"]),
    ]
    for body, expected in wrong:
        content = refused(recorded.post("/jobs", json=body), InvalidRequest)
        loc = content["errors"][0]["loc"]
        assert loc[: 1 + len(expected)] == ["body", *expected], content
    for text in (b"", b"{", b"\xff", b"[" * 100_000):
        answer = recorded.post("/jobs", content=text, headers={"Content-Type": "application/json"})
        refused(answer, InvalidRequest)
    refused(
        recorded.post("/jobs", content=b"{}", headers={"Content-Type": "text/plain"}),
        InvalidRequest,
    )
    assert recorded.get("/jobs?limit=1").json() == before, "nothing was stored"


def test_a_key_makes_one_job(recorded: TestClient) -> None:
    body = {"requests": [evaluation()], "name": "once"}
    first, again = (
        recorded.post("/jobs", json=body, headers={"Idempotency-Key": "jobs-1"}) for _ in range(2)
    )
    assert (first.status_code, again.status_code) == (202, 202)
    assert first.json()["id"] == again.json()["id"]
    assert "idempotency-replayed" not in first.headers
    assert again.headers["idempotency-replayed"] == "true"
    for other in ({"requests": [evaluation(2.0)], "name": "once"}, {"requests": [evaluation()]}):
        refused(
            recorded.post("/jobs", json=other, headers={"Idempotency-Key": "jobs-1"}), KeyReused
        )


def test_an_ended_job_is_retried_or_deleted_but_not_cancelled(client: TestClient) -> None:
    path = sent(client, [evaluation(), TOO_SHORT])
    before = ended(client, path)
    refused(client.post(f"{path}/cancel"), JobNotCancellable)
    answer = client.post(f"{path}/retry")
    assert answer.status_code == 202
    after = ended(client, path)
    assert after["requests"][0] == before["requests"][0], "what was done is untouched"
    assert (after["requests"][1]["attempt"], after["requests"][1]["state"]) == (2, "failed")
    names = [event.name for event in parsed(iter(client.get(f"{path}/events").text.splitlines()))]
    assert names.count("end") == 2, "and the stream goes on after the first"
    assert client.delete(path).status_code == 204
    refused(client.get(path), UnknownJob)
    refused(client.get(before["requests"][0]["answer"]), UnknownAnswer)


def test_settings_beside_a_json_body_are_refused(recorded: TestClient) -> None:
    """Such settings would have no effect."""
    body, query = evaluation()["evaluate"], {"drives": '{"inverter": {"constant": 1.0}}'}
    answer = recorded.post("/evaluate", json=body, params=query)
    (error,) = refused(answer, InvalidRequest)["errors"]
    assert error["loc"] == ["query"] and "JSON body" in error["msg"]


def test_a_job_may_have_a_longer_deadline(recorded: TestClient) -> None:
    longer = move(deadline=300.0)
    refused(recorded.post("/optimize", json=longer), InvalidRequest)
    path = sent(recorded, [{"optimize": longer}])
    assert ended(recorded, path)["counts"]["done"] == 1


def test_limits_of_the_service() -> None:
    with recorded_service(max_waiting=3, max_job_bytes=4096, max_job_deadline=5.0) as small:
        content = refused(small.post("/jobs", json={"requests": [evaluation()] * 4}), Busy)
        assert "jobs" in content["detail"]
        answer = small.post("/jobs", json={"requests": [optimization()] * 100})
        refused(answer, BodyTooLarge)
        late = {"requests": [evaluation(), {"optimize": move(deadline=6.0)}]}
        (error,) = refused(small.post("/jobs", json=late), InvalidRequest)["errors"]
        assert error == {
            "loc": ["body", "requests", 1, "optimize", "deadline"],
            "msg": "Give a number of at most 5: no longer deadline is allowed here.",
        }
