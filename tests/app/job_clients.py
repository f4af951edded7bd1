"""Helpers for tests of jobs over HTTP, and a service killed and restarted during a job."""

from __future__ import annotations

import json
import random
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import httpx2

from joulepath.app.schemas.jobs import Job, JobDetail
from tests.app.live import CLIENT, Server, serving, until
from tests.app.requests import HOME, NEAR, move

PATIENCE = 120.0
"""Most that a job may take on a busy machine [s]; no test waits for it to pass."""
ENDED = ("done", "cancelled")


def evaluation(seconds: float = 1.5) -> dict[str, Any]:
    """A request of a few milliseconds."""
    return {"evaluate": {"configurations": [HOME, NEAR], "time_per_segment": seconds}}


def optimization(mass: float = 1.0, **fields: Any) -> dict[str, Any]:
    """A request of a tenth of a second."""
    return {"optimize": move(payload={"mass": mass, "com": [0.0, 0.0, 0.05]}, **fields)}


def sent(client: Any, requests: list[Any], **fields: Any) -> str:
    """The path of a new job."""
    answer = client.post("/jobs", json={"requests": requests, **fields})
    assert answer.status_code == 202, answer.text
    Job.model_validate_json(answer.content)
    path: str = answer.headers["location"]
    assert path == f"/jobs/{answer.json()['id']}"
    return path


def shown(client: Any, path: str, limit: int = 1000) -> dict[str, Any]:
    """A job as it stands."""
    answer = client.get(f"{path}?limit={limit}")
    assert answer.status_code == 200, answer.text
    JobDetail.model_validate_json(answer.content)
    return answer.json()


def ended(client: Any, path: str) -> dict[str, Any]:
    """A job after its end."""
    end = time.monotonic() + PATIENCE
    while (job := shown(client, path))["state"] not in ENDED:
        assert time.monotonic() < end, job["counts"]
        time.sleep(0.05)
    return job


@dataclass
class Event:
    """One server-sent event."""

    number: int
    name: str
    data: dict[str, Any]


def parsed(lines: Iterator[str]) -> Iterator[Event]:
    """The events in the lines of a stream."""
    found: dict[str, str] = {}
    for line in lines:
        if line:
            name, _, value = line.partition(": ")
            found[name] = value
        elif "id" in found:
            yield Event(int(found["id"]), found["event"], json.loads(found["data"]))
            found = {}


def events(server: Server, path: str, after: int | None = None) -> Iterator[Event]:
    """The events of a job after one, as they come."""
    headers = {} if after is None else {"Last-Event-ID": str(after)}
    with CLIENT.stream("GET", f"{server.url}{path}/events", headers=headers) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        yield from parsed(answer.iter_lines())


MOMENT = 0.03
"""Longest time [s] from an answer to a kill: about that of a request."""


class KilledService:
    """A service on one database, killed again and again, and a client on the events of its job."""

    def __init__(self, folder: Path, seed: int, **settings: Any) -> None:
        self._settings = {"database_url": f"sqlite:///{folder}/joulepath.db", **settings}
        self._rng = random.Random(seed)
        self.kills = 0
        self.events: list[Event] = []
        self.progress_at_kills: list[float] = []

    def run(self, requests: list[Any], kills: int) -> tuple[list[dict[str, Any]], dict[str, Any]]:
        """Sends a job and kills the service `kills` times during its run; returns job and results.

        The kills come after random requests of successive parts of the job.
        """
        path = ""
        while True:
            with serving(**self._settings) as server:
                path = path or sent(over(server), requests)
                follower = threading.Thread(target=self._follow, args=(server, path))
                follower.start()
                if self.kills == kills:
                    job = ended(over(server), path)
                    follower.join()
                    lines = CLIENT.get(f"{server.url}{path}/results").text.splitlines()
                    return [json.loads(line) for line in lines], job
                answered = int(len(requests) * (self.kills + self._rng.random()) / (kills + 1))
                until(partial(self._has, answered))
                time.sleep(self._rng.uniform(0.0, MOMENT))
                server.process.kill()
                self.kills += 1
            follower.join()
            self.progress_at_kills.append(self._answered / len(requests))

    def _has(self, answered: int) -> bool:
        return self._answered >= answered

    @property
    def _answered(self) -> int:
        return sum(event.name == "request" for event in self.events)

    def _follow(self, server: Server, path: str) -> None:
        try:
            for event in events(server, path, self.events[-1].number if self.events else None):
                self.events.append(event)
        except httpx2.TransportError:
            pass  # it was killed


@dataclass(frozen=True)
class _Over:
    """A server as a client with paths instead of URLs."""

    server: Server

    def get(self, path: str) -> Any:
        return self.server.get(path)

    def post(self, path: str, json: Any) -> Any:
        return self.server.post(path, json)


def over(server: Server) -> Any:
    """A client of a running service."""
    return _Over(server)
