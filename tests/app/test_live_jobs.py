"""Jobs in `python -m joulepath.app` over a real socket: killed services and workers, several
services, cancelling, callers."""

from __future__ import annotations

import threading
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from joulepath.app.store.database import create_database_engine
from tests.app.databases import needs_postgres, postgres
from tests.app.job_clients import (
    Event,
    KilledService,
    ended,
    evaluation,
    events,
    optimization,
    over,
    sent,
    shown,
)
from tests.app.live import GRACE, Server, serving, until
from tests.app.requests import long_search, move

LONG = {"optimize": long_search(100.0)}


def mixture(count: int) -> list[dict[str, Any]]:
    """Different requests, one in four of them slower than the others."""
    durations = [1.0 + 0.005 * k for k in range(count)]
    return [evaluation(each) if k % 4 else optimization(each) for k, each in enumerate(durations)]


def check_each_once(lines: list[dict[str, Any]], job: dict[str, Any], requests: list[Any]) -> None:
    """Every request has exactly one answer, its own."""
    assert [line["index"] for line in lines] == list(range(len(requests)))
    assert [line["state"] for line in lines] == ["done"] * len(requests), job["counts"]
    assert len({line["answer"] for line in lines}) == len(requests)
    for line, request in zip(lines, requests, strict=True):
        assert line["result"]["request"] == f"{job['id']}.{line['index']}"
        if line["kind"] == "evaluate":
            assert line["result"]["duration"] == pytest.approx(
                request["evaluate"]["time_per_segment"]
            )


@pytest.mark.parametrize(
    ("kills", "count"),
    [(1, 12), pytest.param(20, 500, marks=pytest.mark.long)],
    ids=["short", "long"],
)
def test_a_killed_service_loses_and_doubles_nothing(kills: int, count: int, tmp_path: Path) -> None:
    """No answer and no event is lost or repeated after the kills of the service.

    The client resumes from the number of its last complete event.
    """
    requests = mixture(count)
    service = KilledService(tmp_path, seed=kills, workers=1, deadline_grace=GRACE)
    lines, job = service.run(requests, kills)
    assert service.kills == kills
    check_each_once(lines, job, requests)
    assert min(service.progress_at_kills) < 1.0, "it was killed while the job ran"
    check_events(service.events, count)


def check_events(found: list[Event], count: int) -> None:
    """No event is lost or repeated."""
    assert [event.number for event in found] == list(range(1, len(found) + 1))
    assert sorted(event.data["index"] for event in found if event.name == "request") == list(
        range(count)
    )
    assert [event.name for event in found].count("end") == 1 and found[-1].name == "end"


def running(server: Server, path: str) -> None:
    """Waits until a worker is at work on the job."""
    until(lambda: shown(over(server), path)["counts"]["running"] > 0)


def test_no_caller_and_no_stop_waits_for_a_job(tmp_path: Path) -> None:
    """A stop ends the event streams of jobs and gives their work back."""
    url, found = f"sqlite:///{tmp_path}/joulepath.db", list[Event]()
    with serving(database_url=url, workers=1, deadline_grace=GRACE) as server:
        path = sent(over(server), [LONG])
        running(server, path)
        assert server.post("/optimize", move()).status_code == 200
        assert shown(over(server), path)["state"] == "running", "it was not waited for"
        server.post(f"{path}/cancel", None)
        assert ended(over(server), path)["state"] == "cancelled"
        path = sent(over(server), [LONG, evaluation()])
        follower = threading.Thread(target=lambda: found.extend(events(server, path)))
        follower.start()
        running(server, path)
        assert server.terminate() == 0
        follower.join()
        assert [entry for entry in server.logged() if entry["level"] == "error"] == []
    assert [event.name for event in found][:2] == ["state", "state"]
    with create_database_engine(url).connect() as connection:
        rows = connection.execute(
            text("SELECT state, leased_by, deaths FROM job_requests WHERE state != 'cancelled'")
        ).all()
    assert [tuple(row) for row in rows] == [("waiting", None, 0)] * 2


@pytest.mark.long
@needs_postgres
def test_services_share_one_postgresql() -> None:
    requests = mixture(60)
    with postgres() as database, ExitStack() as services:
        servers = [
            services.enter_context(serving(database_url=database.url, workers=1)) for _ in range(2)
        ]
        path = sent(over(servers[0]), requests)
        until(lambda: shown(over(servers[1]), path)["counts"]["done"] > 5)
        servers[0].process.kill()
        job = ended(over(servers[1]), path)
        found = list(events(servers[1], path))
    assert Counter(each["state"] for each in job["requests"]) == {"done": 60}
    assert len({each["answer"] for each in job["requests"]}) == 60
    check_events(found, 60)
