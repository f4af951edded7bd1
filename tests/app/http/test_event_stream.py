"""Progress of one request over a real socket: events, the answer or the problem, lost clients."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import Any

import httpx2
import orjson
import pytest

from joulepath import DurationTooShort, InvalidRequest, UnreachablePose
from joulepath.app.answers.declared import model_of
from joulepath.app.api.compare.task import CompareAnswer
from joulepath.app.api.cycle.task import CycleAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.pareto.task import ParetoAnswer
from joulepath.app.exceptions.queue import TooManyRequests, WorkerLost
from joulepath.optimizer.exceptions import DeclaredError
from tests.app.live import CLIENT, GRACE, Server, serving, until
from tests.app.problems import checked
from tests.app.requests import HOME, NEAR, long_search, move

Event = tuple[str, Any]
LISTEN = {"Accept": "text/event-stream"}
SHORT = {"method": "time_scaling"}


@pytest.fixture(scope="module")
def one() -> Iterator[Server]:
    """A server with one worker, and room for a small answer only."""
    with serving(
        workers=1, deadline_grace=GRACE, stop_grace=GRACE, client_bytes_in_flight=150_000
    ) as server:
        yield server


def parsed(text: str) -> Iterator[Event]:
    """The events of a stream, without comments."""
    for block in text.split("\n\n")[:-1]:
        if not block.startswith(":"):
            name, data = block.split("\n")
            yield name.removeprefix("event: "), orjson.loads(data.removeprefix("data: "))


def told(server: Server, path: str, body: Any) -> list[Event]:
    answer = server.post(path, body, headers=LISTEN)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert "content-length" not in answer.headers
    return list(parsed(answer.text))


def names(events: list[Event]) -> list[str]:
    return list(dict.fromkeys(name for name, _ in events))


def test_the_answer_is_that_of_a_request_without_progress(one: Server) -> None:
    events = told(one, "/optimize", move(**SHORT))
    assert names(events) == ["candidates", "candidate", "incumbent", "answer"]
    assert set(events[1][1]) == {"index", "status", "bound", "energy"}
    name, answer = events[-1]
    model_of(OptimizeAnswer).model_validate_json(orjson.dumps(answer))
    incumbent = [content for name, content in events if name == "incumbent"][-1]
    assert incumbent == {
        "energy": answer["energy"]["electrical"]["total"],
        "duration": answer["duration"],
        "bound": answer["energy"]["lower_bound"],
        "gap": answer["energy"]["optimality_gap"],
        "q_goal": answer["branch"]["goal"]["q"],
    }
    plain = one.post("/optimize", move(**SHORT)).json()
    for name in ("request", "id", "answer", "solver"):
        del plain[name]
    assert plain == {name: answer[name] for name in plain}
    assert one.get(answer["answer"]).json()["answer"] == answer, "it is kept"


def test_other_paths_tell_too(one: Server) -> None:
    start, goal = {"q": HOME}, {"q": NEAR}
    front = told(one, "/pareto", move(**SHORT, points=2))
    model_of(ParetoAnswer).model_validate_json(orjson.dumps(front[-1][1]))
    assert front[0] == ("candidates", {"total": 2})
    compared = told(one, "/compare", move(methods=["time_scaling", "uniform_scaling"]))
    model_of(CompareAnswer).model_validate_json(orjson.dumps(compared[-1][1]))
    assert [content["index"] for name, content in compared if name == "candidate"] == [0, 1]
    cycle = told(
        one, "/cycle", {"start": start, "stops": [{"target": goal}], "windings": False, **SHORT}
    )
    model_of(CycleAnswer).model_validate_json(orjson.dumps(cycle[-1][1]))
    for events in (front, compared, cycle):
        assert names(events) == ["candidates", "candidate", "incumbent", "answer"]


def test_what_fails_before_its_search_is_answered_as_ever(one: Server) -> None:
    far = move(goal={"pose": {"position": [5.0, 0.0, 0.0], "quaternion": [0.0, 1.0, 0.0, 0.0]}})
    wrong: list[tuple[Any, type[DeclaredError]]] = [
        ({"start": 1}, InvalidRequest),
        (far, UnreachablePose),
    ]
    for body, problem in wrong:
        answer = one.post("/optimize", body, headers=LISTEN)
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.status_code == checked(problem, answer.json()).status


def test_what_fails_in_its_search_is_an_event(one: Server) -> None:
    name, content = told(one, "/optimize", move(duration=0.01))[-1]
    assert name == "problem"
    problem = checked(DurationTooShort, content)
    # written once the stream has ended
    until(lambda: one.request_logged("/optimize")["request_id"] == problem.instance)


def test_an_answer_without_room_is_a_problem(one: Server) -> None:
    large = move(**SHORT, duration=4.0, sample_period=0.002)
    checked(TooManyRequests, one.post("/optimize", large).json())
    name, content = told(one, "/optimize", large)[-1]
    assert name == "problem"
    checked(TooManyRequests, content)
    until(lambda: one.request_logged("/optimize")["problem"] == "too-many-requests")


def open_stream(server: Server) -> Any:
    return CLIENT.stream("POST", server.url + "/optimize", json=long_search(100.0), headers=LISTEN)


def first_event(stream: httpx2.Response) -> str:
    """The stream is read by single lines, because an event comes while the search runs."""
    return next(stream.iter_lines())


def test_a_search_that_dies_is_a_problem(one: Server) -> None:
    with open_stream(one) as stream:
        lines = stream.iter_lines()
        assert next(lines) == "event: candidates"
        for _ in range(2):  # it begins again once
            until(lambda: "joulepath_workers_busy 1.0" in one.get("/metrics").text)
            (worker,) = one.workers()
            os.kill(worker, signal.SIGKILL)
            until(lambda killed=worker: one.workers() not in ([], [killed]))
        *_, (name, content) = parsed("event: candidates\n" + "".join(f"{line}\n" for line in lines))
    assert name == "problem"
    checked(WorkerLost, content)


def test_leaving_stops_the_work(one: Server) -> None:
    (worker,) = one.workers()
    with open_stream(one) as stream:
        assert first_event(stream) == "event: candidates"
    until(lambda: "joulepath_workers_busy 0.0" in one.get("/metrics").text)
    assert one.workers() == [worker], "the search ended by itself when it was told to"
    until(lambda: one.request_logged("/optimize")["status"] == 499)
