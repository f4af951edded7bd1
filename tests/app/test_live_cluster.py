"""A cluster from plain processes: a scheduler, two machines, two services. A machine and the
scheduler are killed.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from joulepath.app.api.health import ClusterState
from joulepath.app.exceptions.queue import ClusterUnavailable
from tests.app.job_clients import ended, evaluation, over, sent, shown
from tests.app.live import (
    EXIT,
    GRACE,
    ROOT,
    Server,
    alive,
    free_port,
    processor_time,
    serving,
    until,
)
from tests.app.problems import checked
from tests.app.requests import long_search, move
from tests.app.test_live_jobs import check_each_once, mixture
from tests.app.test_server import AT_WORK

pytestmark = pytest.mark.long


@contextmanager
def process(log: Path, *arguments: str, **settings: str) -> Iterator[subprocess.Popen[bytes]]:
    """A Python process of this repository, killed at the end."""
    with log.open("ab") as appended:
        started = subprocess.Popen(
            [sys.executable, "-m", *arguments],
            cwd=ROOT,
            env=os.environ | settings,
            stdout=appended,
            stderr=appended,
        )
    try:
        yield started
    finally:
        started.kill()
        started.wait()


def scheduler(folder: Path, port: int) -> ExitStack:
    started = ExitStack()
    where = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    started.enter_context(
        process(folder / "scheduler.log", "distributed.cli.dask_scheduler", *where)
    )
    return started


def machines(server: Server) -> list[int]:
    """Workers of each machine; none while the scheduler is out of reach."""
    answer = server.get("/cluster")
    if answer.status_code != 200:
        checked(ClusterUnavailable, answer.json())
        return []
    return [each.workers for each in ClusterState.model_validate(answer.json()).machines]


def computing(log: Path) -> list[int]:
    """Warm processes of a machine."""
    found = [int(pid) for pid in re.findall(r'"worker warm","pid":(\d+)', log.read_text())]
    return [pid for pid in found if alive(pid)]


def test_what_is_killed_loses_and_doubles_nothing(tmp_path: Path) -> None:
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        dask = stack.enter_context(scheduler(tmp_path, port))
        logs = [tmp_path / f"machine-{k}.log" for k in range(2)]
        patient = {"JOULEPATH_STOP_GRACE": str(GRACE)}
        started = [
            stack.enter_context(
                process(
                    log,
                    "joulepath.app.cli",
                    "cluster-worker",
                    address,
                    JOULEPATH_WORKERS="1",
                    **patient,
                )
            )
            for log in logs
        ]
        shared = {
            "database_url": f"sqlite:///{tmp_path}/joulepath.db",
            "cluster": address,
            "workers": 1,
        }
        services = [stack.enter_context(serving(**shared, deadline_grace=GRACE)) for _ in range(2)]
        for server in services:
            until(lambda server=server: machines(server) == [1, 1])  # type: ignore[misc]

        requests = mixture(40)
        paths = [sent(over(server), requests) for server in services]
        until(lambda: shown(over(services[0]), paths[0])["counts"]["done"] > 5)
        started[0].kill()
        for server, path in zip(services, paths, strict=True):
            job = ended(over(server), path)
            lines = server.get(f"{path}/results").text.splitlines()
            check_each_once([json.loads(line) for line in lines], job, requests)
        assert all(machines(server) == [1] for server in services)

        path = sent(over(services[0]), [{"optimize": long_search(100.0)}])
        (worker,) = computing(logs[1])
        used = processor_time(worker)
        until(lambda: processor_time(worker) > used + AT_WORK)
        services[0].post(f"{path}/cancel", None)
        assert ended(over(services[0]), path)["state"] == "cancelled"
        # The search would outlast the patience of this test.
        path = sent(over(services[0]), [evaluation()])
        assert ended(over(services[0]), path)["counts"]["done"] == 1
        assert computing(logs[1]) == [worker], "it has ended the search by itself"

        dask.close()
        # Until it notices the loss, a service would begin the job.
        until(lambda: all(machines(server) == [] for server in services))
        path = sent(over(services[0]), [evaluation()])
        assert services[0].post("/optimize", move()).status_code == 200, "by its own worker"
        assert shown(over(services[0]), path)["state"] == "waiting"
        stack.enter_context(scheduler(tmp_path, port))
        assert ended(over(services[0]), path)["counts"]["done"] == 1
        started[1].send_signal(signal.SIGTERM)
        assert started[1].wait(EXIT) == 0
