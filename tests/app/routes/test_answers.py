"""Answers of a sensible size: the requested candidates, and every answer of /optimize by
its path.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import orjson
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.api.answers.models import AnswerList
from joulepath.app.api.cycle.task import CycleAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.engine.result import TaskResult
from joulepath.app.settings import Settings
from joulepath.app.store.store import Store
from joulepath.app.store.store_answers import keep_answer
from tests.app.job_clients import ended, optimization, sent
from tests.app.requests import EXAMPLES, HOME, NEAR, PATIENT, move

TWO_POSES = EXAMPLES["joint_to_pose"]


@pytest.fixture(scope="module")
def everything(client: TestClient) -> dict[str, Any]:
    return client.post("/optimize", json=TWO_POSES | {"candidates": "all"}).json()


@pytest.mark.parametrize(
    ("which", "kept"),
    [("computed", ("solved", "failed")), ("none", ()), (None, ("solved", "failed"))],
)
def test_candidates_as_asked(
    client: TestClient, everything: dict[str, Any], which: str | None, kept: tuple[str, ...]
) -> None:
    answer = client.post(
        "/optimize", json=TWO_POSES | ({} if which is None else {"candidates": which})
    )
    model_of(OptimizeAnswer).model_validate_json(answer.content)
    content = answer.json()
    assert content["candidates"] == [
        each for each in everything["candidates"] if each["status"] in kept
    ]
    counted = Counter(each["status"] for each in everything["candidates"])
    assert {
        status: count for status, count in content["candidate_counts"].items() if count
    } == counted
    assert content["energy"] == everything["energy"]
    assert len(everything["candidates"]) == 256


def test_an_answer_has_its_request_as_it_was_sent(recorded: TestClient) -> None:
    """Answers of jobs and studies have their request, too, but no part of another answer."""
    one = {**move(), "payload": None, "deadline": 9.0}
    (of_job,) = ended(recorded, sent(recorded, [{"optimize": one, "name": "bin to shelf"}]))[
        "requests"
    ]
    assert of_job["name"] == "bin to shelf"
    study = recorded.post("/studies", json={"name": "A study", "threshold": 1.0})
    iterations = f"{study.headers['location']}/iterations"
    step = recorded.post(iterations, json={"optimize": one}).json()
    whole = {"start": {"q": HOME}, "stops": [{"target": {"q": NEAR}}], **PATIENT}
    cycle = recorded.post("/cycle", json=whole).json()
    part = next(leg["answer"] for leg in cycle["legs"] if leg["kind"] == "move")
    own = recorded.post("/optimize", json=one).json()["answer"]
    of_study = {"robot": "ur5e", "objective": "electrical"}
    expected = {of_job["answer"]: one, f"/answers/{step['answer']}": one | of_study, own: one}
    for path, request in (expected | {cycle["answer"]: whole, part: None}).items():
        assert recorded.get(path).json()["request"] == request, path
    typed = {"/deadline": "9,0"}
    assert recorded.patch(own, json={"name": "a", "typed": typed}).status_code == 200
    recorded.patch(own, json={"name": "b"})
    kept = recorded.get(own).json()
    assert (kept["name"], kept["typed"]) == ("b", typed)


def test_the_answers_are_listed(recorded: TestClient) -> None:
    """The list is newest first, in pages, with the figures of the motions, of studies and jobs,
    too.
    """
    own = recorded.post("/optimize", json=move()).json()
    given = {"configurations": [HOME, NEAR], "time_per_segment": 1.5}
    study = recorded.post("/studies", json={"name": "A study", "threshold": 1.0}).headers[
        "location"
    ]
    step = recorded.post(f"{study}/iterations", json={"evaluate": given}).json()
    asked = {
        "start": {"q": HOME},
        "stops": [{"target": {"q": NEAR}}],
        "candidates": "none",
        **PATIENT,
    }
    (row,) = ended(recorded, sent(recorded, [{"cycle": asked}]))["requests"]
    pages, query = [], "/answers?limit=2"
    for _ in range(3):
        page = recorded.get(query)
        AnswerList.model_validate_json(page.content)
        pages.append(page.json())
        query = f"/answers?limit=2&after={pages[-1]['next']}"
    found = [each for page in pages for each in page["answers"]]
    assert [len(page["answers"]) for page in pages[:2]] == [2, 2]
    assert len({each["id"] for each in found}) == len(found) > 4
    assert sorted((each["created"] for each in found), reverse=True) == [
        each["created"] for each in found
    ]
    by_id = {each["id"]: each for each in found}
    assert recorded.get(own["answer"]).json()["created"] == by_id[own["id"]]["created"]
    figures = [by_id[own["answer"].removeprefix("/answers/")], by_id[step["answer"]]]
    energies = [own["energy"]["electrical"]["total"], step["energy"]]
    assert [each["energy"] for each in figures] == energies
    assert [each["duration"] for each in figures] == [own["duration"], 1.5]
    assert [(each["kind"], each["robot"], each["status"]) for each in figures] == [
        ("optimize", "ur5e", own["status"]),
        ("evaluate", "ur5e", None),
    ]
    done = recorded.get(row["answer"]).json()["answer"]
    (whole,) = [each for each in found if each["kind"] == "cycle"]
    assert (
        whole["energy"] == done["energy"]["electrical"]["total"]
        and whole["duration"] == done["duration"]
    )


def test_a_list_may_leave_out_parts_of_other_answers(recorded: TestClient) -> None:
    """On request, the list leaves out motions of cycles and answers of jobs and studies."""
    own = recorded.post("/optimize", json=move()).json()["id"]
    path = sent(recorded, [optimization(1.5)])
    ended(recorded, path)
    asked = {"start": {"q": HOME}, "stops": [{"target": {"q": NEAR}}], **PATIENT}
    cycle = recorded.post("/cycle", json=asked).json()

    def found(**query: Any) -> list[Any]:
        answer = recorded.get("/answers", params={"limit": 200, **query})
        assert answer.status_code == 200, answer.text
        AnswerList.model_validate_json(answer.content)
        return [each["id"] for each in answer.json()["answers"]]

    (of_job,) = found(job=path.rpartition("/")[2])
    motions = {leg["answer"].rpartition("/")[2] for leg in cycle["legs"] if leg["kind"] == "move"}
    assert {own, cycle["id"], of_job} | motions <= set(found())
    whole = set(found(whole=True))
    assert {own, cycle["id"]} <= whole and not whole & {of_job, *motions}


def test_a_result_that_is_not_kept_says_so() -> None:
    name = '","id":null,"answer":"x"}'
    result = TaskResult.of_kept_json(
        {"request": "r", "id": None, "name": name, "answer": None}, AnswerFigures()
    )
    assert result.document.startswith(f'{{"request":"r","id":"{result.kept_as}","name":'.encode())
    assert result.document.endswith(f'"answer":"/answers/{result.kept_as}"}}'.encode())
    without = result.not_kept()
    assert orjson.loads(without.document) == {
        "request": "r",
        "id": None,
        "name": name,
        "answer": None,
    }
    assert without.kept_as is None


@pytest.mark.parametrize(("most", "kept"), [(0, False), (100, False), (1 << 20, True)])
async def test_an_answer_larger_than_all_that_may_be_kept_is_not(
    most: int, kept: bool, store: Store
) -> None:
    content = {"request": "r", "id": None, "q": list(range(1000)), "answer": None}
    result = TaskResult.of_kept_json(content, AnswerFigures())
    answered = await keep_answer(store, Settings(answers_max_bytes=most), "optimize", result, None)
    said = orjson.loads(answered.document)
    assert (said["id"] is not None, said["answer"] is not None) == (kept, kept)


def test_the_answers_of_a_front_and_a_cycle_have_their_paths_and_candidates(
    client: TestClient,
) -> None:
    front = client.post("/pareto", json=move(points=2, candidates="none")).json()
    for point in front["points"]:
        kept = client.get(point["answer"]).json()["answer"]
        assert (kept["answer"], kept["candidates"]) == (point["answer"], [])
        assert sum(kept["candidate_counts"].values()) > 0
    work = {
        "start": {"q": HOME},
        "stops": [{"target": {"q": NEAR}}],
        "candidates": "none",
        **PATIENT,
    }
    answer = client.post("/cycle", json=work)
    model_of(CycleAnswer).model_validate_json(answer.content)
    for leg in answer.json()["legs"]:
        kept = client.get(leg["answer"]).json()["answer"]
        assert (kept["answer"], kept["candidates"]) == (leg["answer"], [])


def test_a_study_keeps_all_candidates_for_its_suggestions(client: TestClient) -> None:
    study = client.post("/studies", json={"name": "A study", "threshold": 1.0}).headers["location"]
    body = {"optimize": TWO_POSES | {"candidates": "none"}}
    step = client.post(f"{study}/iterations", json=body).json()
    assert step["request"] == {"optimize": {**body["optimize"], "objective": "electrical"}}
    kept = client.get(f"/answers/{step['answer']}").json()["answer"]
    assert len(kept["candidates"]) == 256
    assert kept["answer"] == f"/answers/{step['answer']}"
