"""Attacks on the queue and the engine: clients that leave, tight deadlines, killed workers."""

from __future__ import annotations

import os
import random
import signal
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.app.live import CLIENT, GRACE, Server, serving, until
from tests.app.requests import long_search, move


@pytest.fixture(scope="module")
def two() -> Iterator[Server]:
    """A service with two workers, which a busy machine does not kill."""
    with serving(workers=2, deadline_grace=GRACE, stop_grace=GRACE) as server:
        yield server


@pytest.mark.long
def test_clients_that_leave_early_cost_no_worker(two: Server) -> None:
    before = two.workers()

    def leaves(seed: int) -> None:
        rng = random.Random(seed)
        for _ in range(40):
            with two.open("/optimize", move()):
                time.sleep(rng.choice([0.0, 0.01, 0.05]))

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(leaves, range(8)))
    assert two.post("/optimize", move()).status_code == 200
    until(two.is_idle)
    assert two.workers() == before
    asked = [
        entry
        for entry in two.logged()
        if entry["message"] == "request" and entry["path"] == "/optimize"
    ]
    statuses = Counter(entry["status"] for entry in asked)
    assert statuses.keys() <= {200, 499}, statuses
    assert not any(
        "traceback" in entry or entry["message"] == "mended the queue" for entry in two.logged()
    )


@pytest.mark.long
def test_deadlines_that_pass_in_the_queue_cost_no_worker(two: Server) -> None:
    before = two.workers()

    def asks(seed: int) -> set[int]:
        rng = random.Random(seed)
        body = long_search(0.3) if seed % 2 else move(deadline=0.2)
        return {
            two.post("/optimize", {**body, "deadline": rng.uniform(0.05, 0.4)}).status_code
            for _ in range(8)
        }

    with ThreadPoolExecutor(20) as threads:
        statuses = set[int]().union(*threads.map(asks, range(20)))
    assert statuses <= {200, 429, 503, 504}, statuses
    assert two.post("/optimize", move()).status_code == 200
    until(two.is_idle)
    assert two.workers() == before and two.get("/readyz").status_code == 200


@pytest.mark.long
def test_a_request_that_workers_die_of_is_a_problem_with_a_time(two: Server) -> None:
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(CLIENT.post, f"{two.url}/optimize", json=long_search(60.0))
        killed: set[int] = set()
        while not asked.done():
            for pid in set(two.workers()) - killed if not two.is_idle() else set():
                os.kill(pid, signal.SIGKILL)
                killed.add(pid)
            time.sleep(0.02)
        answer = asked.result()
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/worker-lost")
    assert int(answer.headers["Retry-After"]) > 0
    until(lambda: len(two.workers()) == 2)
    assert two.post("/optimize", move()).status_code == 200
