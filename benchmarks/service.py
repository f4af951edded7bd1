"""The service in its own process (`python -m joulepath.app`), and clients over HTTP."""

from __future__ import annotations

import contextlib
import http.client
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import orjson

ROOT = Path(__file__).parents[1]
START_TIMEOUT = 120.0
"""Longest time until the service is ready [s]."""
STOP_TIMEOUT = 20.0
"""Longest time from SIGTERM to the end of the process [s]."""
RETRY_PERIOD = 0.005
"""Time between two attempts to reach the service [s]."""


@dataclass(frozen=True)
class Answer:
    """A response: status, raw body, headers in lower case, and wall time from sending the request
    to the last byte [s].
    """

    status: int
    raw: bytes
    headers: dict[str, str]
    wall: float

    @property
    def content(self) -> Any:
        """The decoded JSON body."""
        return orjson.loads(self.raw)


COMPUTED = {"Cache-Control": "no-cache"}
"""Headers with which the service does not return the stored answer of an equal request."""


class Client:
    """One persistent connection from a loopback address; not thread-safe."""

    def __init__(self, port: int, address: str = "127.0.0.1") -> None:
        self._connection = http.client.HTTPConnection(
            "127.0.0.1", port, timeout=120, source_address=(address, 0)
        )

    def get(self, path: str) -> Answer:
        """Raises OSError or http.client.HTTPException if there is no answer."""
        return self._exchange("GET", path, None)

    def optimize(self, body: dict[str, Any]) -> Answer:
        """`POST /optimize` without stored answers. Raises the same errors as `get`."""
        return self._exchange("POST", "/optimize", orjson.dumps(body), **COMPUTED)

    def send_raw(self, content: bytes) -> None:
        """Sends bytes as they are."""
        self._connection.connect()
        self._connection.sock.sendall(content)

    def _exchange(self, method: str, path: str, body: bytes | None, **headers: str) -> Answer:
        began = time.perf_counter()
        if body:
            headers["Content-Type"] = "application/json"
        try:
            self._connection.request(method, path, body, headers)
            response = self._connection.getresponse()
            raw = response.read()
        except (OSError, http.client.HTTPException):
            self._connection.close()
            raise
        wall = time.perf_counter() - began
        return Answer(response.status, raw, {k.lower(): v for k, v in response.getheaders()}, wall)


@dataclass(frozen=True)
class Service:
    """A running service; `began` is the start of its process [s] by `perf_counter`."""

    process: subprocess.Popen[bytes]
    port: int
    began: float
    log: IO[bytes]

    def client(self) -> Client:
        """A new connection."""
        return Client(self.port)

    @property
    def age(self) -> float:
        """Time since the start of the process [s]."""
        return time.perf_counter() - self.began

    def wait(self, path: str) -> None:
        """Waits until `path` answers 200. Raises RuntimeError if the service ends or needs more
        than START_TIMEOUT."""
        client = self.client()
        while True:
            if self.process.poll() is not None:
                raise RuntimeError("the service ended by itself:\n" + self.logged())
            if self.age > START_TIMEOUT:
                raise RuntimeError(
                    f"no 200 from {path} within {START_TIMEOUT:g} s:\n" + self.logged()
                )
            try:
                if client.get(path).status == 200:
                    return
            except (OSError, http.client.HTTPException):
                pass
            time.sleep(RETRY_PERIOD)

    def logged(self) -> str:
        """The last 4000 bytes of the log."""
        self.log.seek(0)
        return self.log.read()[-4000:].decode(errors="replace")

    def worker_pids(self) -> list[int]:
        """Process ids of the workers: all descendants with more than 32 MiB of memory."""
        return [pid for pid in _descendants(self.process.pid) if resident(pid) > 32]


@contextmanager
def running(**environment: str) -> Iterator[Service]:
    """A ready service on a free port, with default settings except for environment variables.

    The service ends with the context.
    """
    port = _free_port()
    # SIGTERM becomes an exception, so that it also ends the service
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    given = os.environ | {"JOULEPATH_HOST": "127.0.0.1", "PORT": str(port)} | environment
    with tempfile.TemporaryFile() as log, tempfile.TemporaryDirectory() as folder:
        given = {"JOULEPATH_DATABASE_URL": f"sqlite:///{folder}/joulepath.db"} | given
        began = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "joulepath.app"], cwd=ROOT, env=given, stdout=log, stderr=log
        )
        service = Service(process, port, began, log)
        try:
            service.wait("/readyz")
            yield service
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _free_port() -> int:
    """A free port below 32768, from where Linux assigns ports to connections of clients."""
    for port in random.sample(range(20_000, 32_000), 100):
        with socket.socket() as free, contextlib.suppress(OSError):
            free.bind(("127.0.0.1", port))
            return port
    raise RuntimeError("no free port: end other services")


def resident(pid: int) -> float:
    """Resident memory of a process [MiB]; 0 if it has ended."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _descendants(pid: int) -> list[int]:
    parents: dict[int, int] = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = status.read_text().rpartition(")")[2].split()[:2]
        except OSError:  # the process has just ended
            continue
        if state != "Z":
            parents[int(status.parent.name)] = int(parent)
    found, generation = [], {pid}
    while generation:
        generation = {child for child, parent in parents.items() if parent in generation}
        found += sorted(generation)
    return found
