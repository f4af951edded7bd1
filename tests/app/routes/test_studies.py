"""Studies over HTTP: their life, their figures, refusals, and their state after a killed
service.
"""

from __future__ import annotations

import csv
import io
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath import (
    DeadlineExceeded,
    DurationTooShort,
    InvalidRequest,
    InvalidTable,
    UnreachableTargets,
)
from joulepath.app.exceptions.stored import KeyReused, UnknownAnswer, UnknownStudy
from joulepath.app.schemas.studies import IterationDetail, Study, StudySummary
from joulepath.optimizer.exceptions import DeclaredError
from tests.app.documents import open_document
from tests.app.problems import checked
from tests.app.requests import HOME, NEAR, move

ABSENT = "5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7"
LINE = {"optimize": move(method="time_scaling")}
SLOW = {"optimize": move(duration=3.0)}
FREE = {"optimize": move()}
SECRET = "caller-secret-7f3a"


def begin(client: Any, **fields: Any) -> str:
    """The path of a new study."""
    answer = client.post("/studies", json={"name": "A study", "threshold": 50.0, **fields})
    assert answer.status_code == 201, answer.text
    StudySummary.model_validate_json(answer.content)
    path: str = answer.headers["location"]
    assert path == f"/studies/{answer.json()['id']}"
    return path


def added(client: Any, path: str, body: Any, **options: Any) -> dict[str, Any]:
    """A new iteration."""
    answer = client.post(f"{path}/iterations", json=body, **options)
    assert answer.status_code == 201, answer.text
    IterationDetail.model_validate_json(answer.content)
    content: dict[str, Any] = answer.json()
    assert answer.headers["location"] == f"{path}/iterations/{content['number']}"
    return content


def shown(client: Any, path: str) -> dict[str, Any]:
    """A study as it stands."""
    answer = client.get(path)
    assert answer.status_code == 200, answer.text
    Study.model_validate_json(answer.content)
    return answer.json()


@pytest.fixture(scope="module")
def three(client: TestClient) -> tuple[str, list[dict[str, Any]]]:
    """A study of three iterations: a slow motion, the best, the best on a straight line."""
    path = begin(client, threshold=62.0)
    return path, [added(client, path, body) for body in (SLOW, FREE, LINE)]


def test_a_new_study_is_empty(recorded: TestClient) -> None:
    path = begin(recorded, name="Größe 1 ✓", objective="mechanical")
    study = shown(recorded, path)
    assert (study["name"], study["objective"], study["robot"]) == (
        "Größe 1 ✓",
        "mechanical",
        "ur5e",
    )
    assert (study["iterations"], study["history"], study["threshold_met"]) == (0, [], False)
    assert (study["last"], study["best"], study["threshold_met_by"]) == (None, None, None)


def test_each_iteration_is_held_against_those_before(client: TestClient, three: Any) -> None:
    path, steps = three
    slow, free, line = (step["energy"] for step in steps)
    # idle power alone: 3 s at 37 W
    assert free < line < slow
    assert [step["number"] for step in steps] == [1, 2, 3]
    assert [step["change_from_last"] for step in steps] == [None, free - slow, line - free]
    assert [step["change_from_best"] for step in steps] == [None, free - slow, line - free]
    assert [step["best"]["number"] for step in steps] == [1, 2, 2]
    assert (
        [step["threshold_met"] for step in steps]
        == [slow <= 62, free <= 62, line <= 62]
        == [False, True, True]
    )
    assert [step["threshold_met_by"] for step in steps] == [None, 2, 2]
    study = shown(client, path)
    assert study["history"] == [
        {name: value for name, value in step.items() if name in study["history"][0]}
        for step in steps
    ]
    assert study["best"] == {"number": 2, "energy": free}
    assert study["last"] == {"number": 3, "energy": line}
    assert (study["threshold_met"], study["threshold_met_by"], study["iterations"]) == (True, 2, 3)


def test_an_iteration_keeps_its_request_and_its_whole_answer(
    client: TestClient, three: Any
) -> None:
    path, steps = three
    assert client.get(f"{path}/iterations/2").json() == steps[1]
    kept = client.get(f"/answers/{steps[1]['answer']}").json()
    assert kept["kind"] == "optimize"
    alone = client.post("/optimize", json=FREE["optimize"]).json()
    assert kept["answer"]["energy"] == alone["energy"]
    assert kept["answer"]["trajectory"] == alone["trajectory"]
    assert steps[1]["energy"] == kept["answer"]["energy"]["electrical"]["total"]
    assert steps[1]["mechanical"] == kept["answer"]["energy"]["mechanical"]["total"]
    sent_again = added(client, path, steps[1]["request"])
    assert sent_again["energy"] == steps[1]["energy"]


def test_the_studys_objective_is_the_iterations(client: TestClient) -> None:
    path = begin(client, objective="mechanical")
    step = added(client, path, {"optimize": move(duration=2.0, method="time_scaling")})
    assert step["request"]["optimize"]["objective"] == "mechanical"
    assert step["energy"] == step["mechanical"] < step["electrical"]
    answer = client.post(
        f"{path}/iterations", json={"optimize": move(duration=2.0, objective="electrical")}
    )
    assert checked(InvalidRequest, answer.content).errors[0].loc == [
        "body",
        "optimize",
        "objective",
    ]


def test_the_history_as_a_table(client: TestClient, three: Any) -> None:
    path, _ = three
    study = shown(client, path)
    answer = client.get(path, headers={"accept": "text/csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [int(row["iteration"]) for row in rows] == [
        entry["number"] for entry in study["history"]
    ]
    for row, entry in zip(rows, study["history"], strict=True):
        assert row["created"] == entry["created"]
        assert float(row["energy_J"]) == entry["energy"]
        assert float(row["duration_s"]) == entry["duration"]
        assert (float(row["change_from_last_J"]) if row["change_from_last_J"] else None) == entry[
            "change_from_last"
        ]
        assert row["threshold_met"] == str(entry["threshold_met"]).lower()


FAR = {"pose": {"position": [2.0, 0.0, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
TIMES = {"t": [0.0, 1.0, 1.0, 2.0, 3.0], "q": [HOME, NEAR, NEAR, HOME, NEAR]}


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        ({"optimize": move(goal={"any_of": [FAR, FAR]})}, UnreachableTargets),
        ({"evaluate": {"trajectory": TIMES}}, InvalidTable),
    ],
)
def test_what_either_endpoint_refuses_is_documented(
    client: TestClient, body: Any, kind: type[DeclaredError]
) -> None:
    answer = client.post(f"{begin(client)}/iterations", json=body)
    checked(kind, answer.content)
    responses = open_document()["paths"]["/studies/{id}/iterations"]["post"]["responses"]
    schema = responses[str(answer.status_code)]["content"]["application/problem+json"]["schema"]
    assert answer.json()["type"] in schema["discriminator"]["mapping"]


def test_a_failed_request_leaves_no_trace(client: TestClient) -> None:
    path = begin(client)
    answer = client.post(f"{path}/iterations", json={"optimize": move(duration=0.05)})
    checked(DurationTooShort, answer.content)
    answer = client.post(f"{path}/iterations", json={"optimize": move(deadline=1e-3)})
    checked(DeadlineExceeded, answer.content)
    assert shown(client, path)["iterations"] == 0
    assert added(client, path, FREE)["number"] == 1


def test_deleted_with_all_that_belongs_to_it(recorded: TestClient) -> None:
    path = begin(recorded)
    step = added(recorded, path, FREE)
    assert recorded.delete(path).status_code == 204
    for gone in (recorded.get(path), recorded.delete(path), recorded.get(f"{path}/iterations/1")):
        checked(UnknownStudy, gone.content)
    checked(UnknownStudy, recorded.post(f"{path}/iterations", json=FREE).content)
    checked(UnknownAnswer, recorded.get(f"/answers/{step['answer']}").content)


def test_a_repeated_request_makes_nothing_new(recorded: TestClient) -> None:
    key = {"Idempotency-Key": "begin-once"}
    body = {"name": "Once", "threshold": 50.0}
    first, second = (recorded.post("/studies", json=body, headers=key) for _ in range(2))
    assert first.json() == second.json()
    assert (first.status_code, second.status_code) == (201, 201)
    assert "idempotency-replayed" not in first.headers
    assert second.headers["idempotency-replayed"] == "true"
    reused = recorded.post("/studies", json=body | {"threshold": 51.0}, headers=key)
    checked(KeyReused, reused.content)

    path = first.headers["location"]
    steps = [added(recorded, path, FREE, headers=key) for _ in range(2)]
    assert steps[0] == steps[1]
    checked(KeyReused, recorded.post(f"{path}/iterations", json=LINE, headers=key).content)
    assert added(recorded, begin(recorded), LINE, headers=key)["number"] == 1, (
        "a key belongs to one study"
    )
    assert shown(recorded, path)["iterations"] == 1


def test_a_request_repeated_while_it_runs_makes_one_iteration(recorded: TestClient) -> None:
    path = begin(recorded)
    with ThreadPoolExecutor(4) as pool:
        headers = {"Idempotency-Key": "at-once"}
        steps = list(pool.map(lambda _: added(recorded, path, FREE, headers=headers), range(4)))
    assert all(step == steps[0] for step in steps)
    assert shown(recorded, path)["iterations"] == 1


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ({}, ["body", "name"]),
        ({"name": ""}, ["body", "name"]),
        ({"name": "  "}, ["body", "name"]),
        ({"name": "x" * 201}, ["body", "name"]),
        ({"name": "a\0b"}, ["body", "name"]),
        ({"name": "a\nb"}, ["body", "name"]),
        ({"name": 5}, ["body", "name"]),
        ({"threshold": None}, ["body", "threshold"]),
        ({"threshold": "50"}, ["body", "threshold"]),
        ({"threshold": 0}, ["body", "threshold"]),
        ({"threshold": -1.0}, ["body", "threshold"]),
        ({"threshold": 1e300}, ["body", "threshold"]),
        ({"threshold": True}, ["body", "threshold"]),
        ({"objective": SECRET}, ["body", "objective"]),
        ({f"a {SECRET}": 1}, ["body"]),
    ],
)
def test_a_malformed_study_is_refused(
    recorded: TestClient, body: dict[str, Any], loc: list[str]
) -> None:
    sent = body if not body else {"name": "A study", "threshold": 50.0, **body}
    answer = recorded.post("/studies", json=sent)
    assert answer.status_code == 422
    errors = checked(InvalidRequest, answer.content).errors
    assert loc in [error.loc for error in errors]
    assert SECRET not in answer.text


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"optimise": {}},
        {"optimize": {}},
        {"optimize": move(**{f"a {SECRET}": 1})},
        {**FREE, f"a {SECRET}": {}},
        [],
        None,
    ],
)
def test_a_malformed_iteration_is_refused(recorded: TestClient, body: Any) -> None:
    answer = recorded.post(f"{begin(recorded)}/iterations", json=body)
    assert checked(InvalidRequest, answer.content).errors
    assert SECRET not in answer.text


@pytest.mark.parametrize("key", ["", "x" * 129, "two words"])
def test_a_malformed_key_is_refused(recorded: TestClient, key: str) -> None:
    answer = recorded.post(
        "/studies", json={"name": "A", "threshold": 1.0}, headers={"Idempotency-Key": key}
    )
    (error,) = checked(InvalidRequest, answer.content).errors
    assert error.loc == ["header", "Idempotency-Key"]


@pytest.mark.parametrize(
    ("number", "kind"), [("2", UnknownStudy), ("0", InvalidRequest), ("9" * 30, InvalidRequest)]
)
def test_unknown_iteration(recorded: TestClient, number: str, kind: type[DeclaredError]) -> None:
    path = begin(recorded)
    checked(kind, recorded.get(f"{path}/iterations/{number}").content)
