"""Cached answers: found by the canonical form of a request, by its owner alone, and for a while."""

from __future__ import annotations

import asyncio
from datetime import timedelta
from pathlib import Path
from typing import Any

import orjson
import pytest
from starlette.testclient import TestClient

from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.settings import Settings
from joulepath.app.store.answers import prune
from joulepath.app.store.cache import Asked
from joulepath.app.store.store import Store
from joulepath.app.store.store_answers import keep_answer
from joulepath.app.store.tables import CachedAnswer
from joulepath.app.tasks import answer_cache, request_key
from joulepath.app.tasks.answer_cache import AnswerCache
from joulepath.app.tasks.answer_collector import figures_of
from joulepath.app.tasks.read_body import HeldBody
from tests.app.job_clients import ended
from tests.app.requests import HOME, NEAR, move

KNOWN = {"Cache-Control": "max-age=60"}


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raises the patience with the store for a busy machine."""
    monkeypatch.setattr(answer_cache, "QUERY_TIMEOUT", 60.0)


def sent(client: TestClient, body: Any, **headers: str) -> Any:
    answer = client.post(
        "/optimize",
        content=orjson.dumps(body),
        headers={"Content-Type": "application/json"} | headers,
    )
    assert answer.status_code == 200, answer.text
    return answer


def load(mass: float) -> dict[str, Any]:
    return {"mass": mass, "com": [0.0, 0.0, 0.05]}


def is_hit(answer: Any) -> bool:
    cached = answer.headers.get("joulepath-cache") == "hit"
    assert cached == ("age" in answer.headers)
    return cached


def test_answers_of_other_code_are_computed_again(
    recorded: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = move(method="time_scaling", payload=load(0.122))
    sent(recorded, body, **KNOWN)
    monkeypatch.setattr(request_key, "VERSION", "after an update")
    assert not is_hit(sent(recorded, body, **KNOWN))


def test_an_equal_request_has_the_same_answer(recorded: TestClient) -> None:
    body = move(method="time_scaling", payload=load(0.123))
    first = sent(recorded, body, **KNOWN)
    assert not is_hit(first)
    again = sent(recorded, body, **KNOWN | {"X-Request-ID": "another-one"})
    assert is_hit(again) and 0 <= int(again.headers["age"]) < 1000
    assert again.json()["request"] == "another-one"
    assert again.content == first.content.replace(
        first.json()["request"].encode(), b"another-one", 1
    )
    assert again.json()["id"] == first.json()["id"], "the same answer"
    spelled_out = {
        "windings": True,
        "payload": load(0.123),
        "goal": {"q": NEAR},
        "start": {"q": HOME},
    }
    assert is_hit(
        sent(
            recorded,
            spelled_out | {"method": "time_scaling", "robot": "ur5e", "deadline": 17},
            **KNOWN,
        )
    )
    assert not is_hit(sent(recorded, body | {"payload": load(0.124)}, **KNOWN))
    assert not is_hit(sent(recorded, body | {"candidates": "all"}, **KNOWN))
    events = sent(recorded, body, **KNOWN, Accept="text/event-stream").text
    assert events.startswith("event: answer\n") and events.count("event:") == 1


def test_it_is_computed_again_if_asked_for(recorded: TestClient) -> None:
    body = move(method="time_scaling", payload=load(0.125))
    first = sent(recorded, body).json()
    fresh = sent(recorded, body, **{"Cache-Control": "no-cache"})
    assert not is_hit(fresh) and fresh.json()["answer"] != first["answer"]
    again = sent(recorded, body, **KNOWN)
    assert is_hit(again) and again.json()["answer"] == fresh.json()["answer"], "the last one"


def test_what_is_deleted_is_computed_again(recorded: TestClient) -> None:
    body = move(method="time_scaling", payload=load(0.126))
    first = sent(recorded, body).json()
    assert is_hit(sent(recorded, body, **KNOWN))
    assert recorded.delete(first["answer"]).status_code == 204
    assert not is_hit(sent(recorded, body, **KNOWN))


def test_a_body_that_a_worker_reads_is_computed(recorded: TestClient) -> None:
    points = [[1.0 + 1e-3 * k, 2.0, 3.0] for k in range(5000)]
    obstacle = {"name": "x", "shape": "points", "points": points, "radius": 0.01}
    body = move(method="time_scaling", scene={"obstacles": [obstacle]})
    for _ in range(2):
        assert not is_hit(sent(recorded, body, **KNOWN))


def result(number: int, status: str) -> TaskResult:
    content = {"request": "first", "id": None, "status": status, "number": number, "answer": None}
    return TaskResult.of_kept_json(content, figures_of(content))


async def test_what_is_pruned_is_forgotten(store: Store) -> None:
    asked = Asked("key", 1.0)
    await keep_answer(store, Settings(), "optimize", result(1, "optimal"), None, asked)
    await store.write(lambda session: prune(session, 0, timedelta(days=1)))
    assert await AnswerCache(store, None, False).find(asked, "mine") is None
    assert await store.read(lambda session: session.query(CachedAnswer).count()) == 0


async def test_keys_tell_clients_kinds_and_robots_apart(store: Store) -> None:
    body = OptimizeRequest.model_validate(move())

    async def key(owner: str | None = None, kind: str = "optimize", **fields: Any) -> str | None:
        asked = await AnswerCache(store, owner, False).asked(
            kind, body.model_copy(update=fields), 1.0
        )
        return None if asked is None else asked.key

    keys = [
        await key(),
        await key("a"),
        await key("b"),
        await key(kind="pareto"),
        await key(robot="ur10e"),
    ]
    assert len(set(keys)) == 5 and None not in keys
    assert await key() == await key(deadline=77.0)
    assert await key(robot="nobodys") is None
    cache_of_large = AnswerCache(store, None, False)
    assert await cache_of_large.asked("optimize", HeldBody(b"", {}, set()), 1.0) is None
    assert await cache_of_large.find(None, "mine") is None


async def test_a_database_that_hangs_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answer_cache, "QUERY_TIMEOUT", 0.1)

    class Hanging(Store):
        async def read(self, work: Any) -> Any:
            await asyncio.Event().wait()

    store = Hanging(f"sqlite:///{tmp_path}/joulepath.db")
    assert await AnswerCache(store, None, False).find(Asked("key", 1.0), "mine") is None


def job(client: TestClient, requests: list[Any], headers: dict[str, str]) -> list[dict[str, Any]]:
    """The lines of the results of a job."""
    answer = client.post("/jobs", json={"requests": requests}, headers=headers)
    assert answer.status_code == 202, answer.text
    path = answer.headers["location"]
    assert ended(client, path)["state"] == "done"
    return [orjson.loads(line) for line in client.get(f"{path}/results").text.splitlines()]


def without_paths(answer: dict[str, Any]) -> dict[str, Any]:
    return {
        name: value for name, value in answer.items() if name not in ("request", "id", "answer")
    }


def test_jobs_have_what_was_answered_and_answer_what_comes(recorded: TestClient) -> None:
    body = move(method="time_scaling", payload=load(0.127))
    first = sent(recorded, body, **KNOWN).json()
    spelled_out = body | {"robot": "ur5e", "deadline": 3.0}
    lines = job(recorded, [{"optimize": body}, {"optimize": spelled_out}], KNOWN)
    for line in lines:
        # as well as the wall times of the search
        assert without_paths(line["result"]) == without_paths(first)
        assert line["result"]["answer"] == line["answer"] != first["answer"]
        assert (
            line["energy"] == first["energy"]["electrical"]["total"]
            and line["status"] == first["status"]
        )
    other = move(method="time_scaling", payload=load(0.128))
    (line,) = job(recorded, [{"optimize": other}], KNOWN)
    again = sent(recorded, other, **KNOWN)
    assert is_hit(again) and without_paths(again.json()) == without_paths(line["result"])
    (fresh,) = job(recorded, [{"optimize": other}], {"Cache-Control": "no-cache"})
    assert fresh["result"]["solver"] != line["result"]["solver"], "it has taken another time"


def test_studies_have_what_was_answered_and_answer_what_comes(recorded: TestClient) -> None:
    body = move(method="time_scaling", payload=load(0.129))
    study = recorded.post("/studies", json={"name": "cached", "threshold": 1.0}).headers["location"]

    def step(**headers: str) -> dict[str, Any]:
        made = recorded.post(f"{study}/iterations", json={"optimize": body}, headers=headers)
        assert made.status_code == 201, made.text
        path = f"/answers/{made.json()['answer']}"
        answer: dict[str, Any] = recorded.get(path).json()["answer"]
        assert answer["answer"] == path
        return answer

    first, second, fresh = step(**KNOWN), step(**KNOWN), step(**{"Cache-Control": "no-cache"})
    assert without_paths(first) == without_paths(second) and first["id"] != second["id"]
    assert fresh["solver"] != first["solver"]
    again = sent(recorded, body | {"candidates": "all"}, **KNOWN)
    assert is_hit(again) and without_paths(again.json()) == without_paths(fresh), "the last one"
