"""`python -m joulepath.app` as a process, talked to over a real socket."""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2

from tests.app.forks import ROOT as ROOT
from tests.app.forks import Fork
from tests.app.shared import migrated

LOCAL = "http://localhost"
"""Where a client in the same process finds the service: a name that it is always known by."""
WARM_UP = 150.0
"""Most that a cold start may take on a busy machine [s]: imports, loading the kernels, a first
solve. Alone: 3 s.
"""
EXIT = 60.0
"""Most that may pass from SIGTERM to the end of the process on a busy machine [s]."""
GRACE = 60.0
"""`deadline_grace` [s]: on a busy machine, no worker that is about to answer is killed."""
ANSWER = 120.0
"""Most that an answer may take on a busy machine [s]."""
COMPUTED = {"Cache-Control": "no-cache"}
"""Headers of a request whose answer is to be computed, although an equal request was answered
before.
"""
CLIENT = httpx2.Client(
    timeout=ANSWER, limits=httpx2.Limits(max_keepalive_connections=0), headers=COMPUTED
)
"""For any thread, with a connection of its own for every request. To make one loads the
certificates of all issuers.
"""


@dataclass(frozen=True)
class OpenRequest:
    """A sent request; leaving the context closes its connection."""

    connection: socket.socket

    @property
    def answered(self) -> bool:
        """Whether the answer has begun to arrive."""
        return bool(select.select([self.connection], [], [], 0)[0])

    def status(self) -> int:
        """HTTP status of the answer, whose first bytes must have arrived."""
        return int(self.connection.recv(len(b"HTTP/1.1 200")).split()[1])

    def __enter__(self) -> OpenRequest:
        return self

    def __exit__(self, *_: object) -> None:
        self.connection.close()


@dataclass(frozen=True)
class Server:
    """A running service."""

    process: Fork
    url: str
    log: Path

    def get(self, path: str) -> httpx2.Response:
        return CLIENT.get(self.url + path)

    def post(self, path: str, body: Any, **options: Any) -> httpx2.Response:
        return CLIENT.post(self.url + path, json=body, **options)

    def open(self, path: str, body: Any, **headers: str) -> OpenRequest:
        """A POST over a connection of its own, with no wait for the answer."""
        host, port = self.url.removeprefix("http://").split(":")
        content = json.dumps(body).encode()
        head = {
            "Host": host,
            "Content-Type": "application/json",
            "Content-Length": str(len(content)),
        }
        head |= COMPUTED | headers
        lines = [
            f"POST {path} HTTP/1.1",
            *(f"{name}: {value}" for name, value in head.items()),
            "",
            "",
        ]
        connection = socket.create_connection((host, int(port)), timeout=ANSWER)
        connection.sendall("\r\n".join(lines).encode() + content)
        return OpenRequest(connection)

    def logged(self) -> list[dict[str, Any]]:
        """Every finished line of the log, as JSON; an unfinished line is left for the next call."""
        finished, _, _ = self.log.read_bytes().rpartition(b"\n")
        return [json.loads(line) for line in finished.splitlines()]

    def descendants(self) -> set[int]:
        """Process ids of the server's children, theirs, and so on."""
        found: set[int] = set()
        parents, parent_of = {self.process.pid}, _parents()
        while parents:
            parents = {pid for pid, parent in parent_of.items() if parent in parents} - found
            found |= parents
        return found

    def workers(self) -> list[int]:
        """Process ids of the warm workers alive."""
        alive = self.descendants()
        return [
            entry["pid"]
            for entry in self.logged()
            if entry["message"] == "worker warm" and entry["pid"] in alive
        ]

    def terminate(self) -> int:
        """Exit code after a SIGTERM."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(EXIT)

    def is_idle(self) -> bool:
        """Whether no request is in a worker or waits for one."""
        found = self.get("/metrics").text
        return "joulepath_workers_busy 0.0" in found and "joulepath_queue_length 0.0" in found

    def request_logged(self, path: str) -> dict[str, Any]:
        """The log's line about the last answered request for this path."""
        end = time.monotonic() + ANSWER
        while True:
            found = [
                entry
                for entry in self.logged()
                if entry["message"] == "request" and entry["path"] == path
            ]
            if found:
                return found[-1]
            assert time.monotonic() < end, f"no request for {path} is logged"
            time.sleep(0.02)

    def wait_listening(self) -> None:
        """Waits until the service answers, with warm workers or not."""
        self._wait_for("/healthz", "the server does not listen")

    def wait_ready(self) -> None:
        """Waits until all workers are warm."""
        self._wait_for("/readyz", "the workers do not warm up")

    def _wait_for(self, path: str, failure: str) -> None:
        end = time.monotonic() + WARM_UP
        while True:
            assert self.process.poll() is None, "the server ended by itself"
            assert time.monotonic() < end, failure
            try:
                if self.get(path).status_code == 200:
                    return
            except httpx2.TransportError:
                pass
            time.sleep(0.05)


def free_port() -> int:
    """A port unused on this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@contextmanager
def serving(
    warm: bool = True, recorded: bool = False, by_command: bool = False, **settings: Any
) -> Iterator[Server]:
    """A server with these settings, by default waited for until it is warm and with a
    database of its own without rows.

    With `recorded`, its searches are recorded (see `tests.app.recorded`): it has no worker
    processes. With `by_command`, `joulepath serve` starts it, else `python -m joulepath.app`.
    """
    program: tuple[str, ...] = ("tests.app.recorded" if recorded else "joulepath.app",)
    if by_command:
        program = ("joulepath.app.cli", "serve")
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log")
        settings = {"host": "127.0.0.1", **settings}
        if "database_url" not in settings:
            settings["database_url"] = migrated(Path(folder))
        environment = {f"JOULEPATH_{name.upper()}": str(value) for name, value in settings.items()}
        environment |= {"JOULEPATH_LOG_LEVEL": "debug", "PORT": str(port)}
        with log.open("ab") as appended:
            process = Fork(program, os.environ | environment, (0, 1, appended.fileno()))
        server = Server(process, f"http://127.0.0.1:{port}", log)
        try:
            if warm:
                server.wait_ready()
            yield server
        finally:
            process.kill()
            process.wait()


def until(condition: Callable[[], bool], patience: float = ANSWER) -> None:
    """Waits until a condition holds, for `patience` [s] at most."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def processor_time(pid: int) -> float:
    """Processor time used by a process [s]; a worker without a task uses none."""
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


def alive(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    return _parent(pid) is not None


def _parent(pid: int) -> int | None:
    """Parent of a process; None if it has ended."""
    try:
        state, parent = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
    except OSError:
        return None
    return None if state == "Z" else int(parent)


def _parents() -> dict[int, int]:
    """Parent of every living process."""
    pids = [int(folder.name) for folder in Path("/proc").glob("[0-9]*")]
    return {pid: parent for pid in pids if (parent := _parent(pid)) is not None}
