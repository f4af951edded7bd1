"""Crowds of clients on one service: impatient clients, short deadlines, or mixed requests.

Each crowd has a new service. An honest client optimises short motions before, during and after the
crowd, and a second client requests `/healthz`. The service passes if no status is 500, if all
workers run afterwards, and if the honest client receives at least a third as many answers during
the crowd as before it.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
import signal
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from benchmarks.attack_bodies import long_search, move
from benchmarks.observed_attack import honest, in_parallel, probe
from benchmarks.service import Service, running

ADDRESSES = [f"127.0.0.{k}" for k in range(66, 70)]
"""Addresses of the crowd; the service counts every address as a client."""
QUIET_TIME = 15.0
"""Duration of the phases without a crowd [s]."""
SETTLING = 5.0
"""Time from the end of a crowd until all workers must run again [s]."""
LONGEST_CROWD = 30.0
"""Longest duration of every crowd except `mixed` [s]."""
IMPATIENT_TIMEOUT = 0.05
"""Timeout of an impatient client [s]."""
HURRIED_TIMEOUT = 1.0
"""Timeout of a hurried client [s]."""
TIGHT_DEADLINE = 2.0
"""Deadline of the requests of the crowd `tight` [s]."""
TIMEOUT = 60.0
"""Timeout of every other client [s]."""
HEAD = (
    "| crowd | phase | s | honest 200 per s | honest other | crowd | workers | /readyz | /healthz "
    "p99, ms | most |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)
COUNTED_MESSAGES = ('"traceback"', "did not end in time", "begins again")
"""Texts to count in the log of the service."""
DISCONNECTED = 0
"""Replaces the status if the client disconnected before the answer."""


@dataclass(frozen=True)
class Phase:
    """Observations of a phase: its duration `time` [s], counts of the statuses of the honest client
    and of the crowd, number of workers and status of `/readyz` at its end, response times of
    `/healthz` [ms]."""

    name: str
    time: float
    honest: dict[int, int]
    crowd: dict[int, int]
    workers: int
    ready: int
    healthz_p99: float
    healthz_most: float


async def ask(
    port: int, address: str, path: str, body: dict[str, Any], timeout: float = TIMEOUT
) -> int:
    """The status of the answer; DISCONNECTED if it does not arrive within the timeout [s]."""
    content = orjson.dumps(body)
    head = (
        f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nConnection: "
        "close\r\n"
        f"Cache-Control: no-cache\r\nContent-Length: {len(content)}\r\n\r\n"
    )
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(address, 0))
    try:
        writer.write(head.encode() + content)
        async with asyncio.timeout(timeout):
            status = int((await reader.readline()).split()[1])
            while await reader.read(1 << 16):
                pass
            return status
    except (TimeoutError, OSError, IndexError):
        return DISCONNECTED
    finally:
        writer.transport.abort()


async def impatient(port: int, address: str, rng: random.Random) -> int:
    """A client that disconnects soon after its request."""
    return await ask(port, address, "/optimize", move(), IMPATIENT_TIMEOUT)


async def patient(port: int, address: str, rng: random.Random) -> int:
    """A client that waits for its answer."""
    return await ask(port, address, "/optimize", move())


async def hurried(port: int, address: str, rng: random.Random) -> int:
    """A client whose timeout is shorter than the time its request needs in the crowd."""
    return await ask(port, address, "/optimize", move(), HURRIED_TIMEOUT)


async def tight(port: int, address: str, rng: random.Random) -> int:
    """A client that waits for its answer, and sets a short deadline in the request."""
    status = await ask(port, address, "/optimize", move() | {"deadline": TIGHT_DEADLINE})
    await asyncio.sleep(0.1 if status in (429, 503) else 0.0)
    return status


async def mixed(port: int, address: str, rng: random.Random) -> int:
    """A client with a random request (a motion, a long search, inverse kinematics, a front or a
    job) and a random timeout."""
    pose = {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}
    path, body = rng.choice(
        [
            ("/optimize", move()),
            ("/optimize", move() | {"deadline": rng.choice([0.2, 1.0, TIGHT_DEADLINE])}),
            ("/optimize", long_search(rng.choice([TIGHT_DEADLINE, 5.0]))),
            ("/ik", {"pose": pose}),
            ("/pareto", {**move(), "points": 3, "deadline": 5.0}),
            ("/jobs", {"requests": [{"optimize": move() | {"deadline": 5.0}}]}),
        ]
    )
    timeout = rng.choice([IMPATIENT_TIMEOUT, 0.3, 1.0, TIMEOUT, TIMEOUT])
    status = await ask(port, address, path, body, timeout)
    await asyncio.sleep(rng.uniform(0.0, 0.2))
    return status


Kind = Callable[[int, str, random.Random], Awaitable[int]]
CROWDS: dict[str, tuple[Kind, int, int]] = {
    "impatient": (impatient, 8, 1),
    "patient": (patient, 12, 1),
    "hurried": (hurried, 12, 1),
    "tight": (tight, 60, len(ADDRESSES)),
    "mixed": (mixed, 24, len(ADDRESSES)),
}
"""Crowds by name: the repeated request of a connection, the number of connections, and the number
of addresses."""


async def crowd(service: Service, name: str, seconds: float, kill_every: float) -> Counter[int]:
    """Counts of the statuses received by a crowd within `seconds`.

    A random worker is killed every `kill_every` seconds, or none if it is zero.
    """
    kind, connections, addresses = CROWDS[name]
    end, seen = time.perf_counter() + seconds, Counter[int]()

    async def one(index: int) -> None:
        rng = random.Random(index)
        while time.perf_counter() < end:
            with contextlib.suppress(OSError):
                seen[await kind(service.port, ADDRESSES[index % addresses], rng)] += 1

    async def kill() -> None:
        rng = random.Random(0)
        while kill_every:
            await asyncio.sleep(kill_every)
            if pids := workers_of(service):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(rng.choice(pids), signal.SIGKILL)

    killing = asyncio.create_task(kill())
    await asyncio.gather(*(one(index) for index in range(connections)))
    killing.cancel()
    return seen


def workers_of(service: Service) -> list[int]:
    """Process ids of the workers: descendants of the service other than its children, because the
    fork server starts them."""
    children = (
        Path(f"/proc/{service.process.pid}/task/{service.process.pid}/children").read_text().split()
    )
    pids = service.worker_pids()
    return [pid for pid in pids if str(pid) not in children]


def observed(service: Service, name: str, attack: Callable[[], Counter[int]]) -> Phase:
    """The observations of the phase in which `attack` runs."""
    port = service.port
    with in_parallel(probe, port) as end_probe, in_parallel(honest, port) as end_honest:
        began = time.perf_counter()
        statuses = attack()
        duration = time.perf_counter() - began
        walls, answers = end_probe(), end_honest()
    metrics = service.client().get("/metrics").raw.decode()
    workers = next(
        line for line in metrics.splitlines() if line.startswith("joulepath_workers_warm ")
    )
    return Phase(
        name,
        duration,
        dict(Counter(status for status, _ in answers)),
        dict(statuses),
        int(float(workers.split()[1])),
        service.client().get("/readyz").status,
        float(np.percentile(walls, 99)) * 1e3,
        max(walls) * 1e3,
    )


def alone() -> Counter[int]:
    """A phase without a crowd."""
    time.sleep(QUIET_TIME)
    return Counter()


def line(name: str, phase: Phase) -> str:
    """A row of the table."""
    rate = phase.honest.get(200, 0) / phase.time
    crowd = ", ".join(
        f"{count} × {status or 'left'}" for status, count in sorted(phase.crowd.items())
    )
    refusals = ", ".join(
        f"{count} × {status}" for status, count in sorted(phase.honest.items()) if status != 200
    )
    return (
        f"| {name} | {phase.name} | {phase.time:.0f} | {rate:.2f} | {refusals} | {crowd} | "
        f"{phase.workers} | {phase.ready} | {phase.healthz_p99:.0f} | {phase.healthz_most:.0f} |"
    )


def report(name: str, minutes: float, kill_every: float) -> list[Phase]:
    """Runs a crowd on a new service, and prints and returns its phases.

    Args:
        name: name of the crowd.
        minutes: duration of the crowd [min], at most LONGEST_CROWD except for `mixed`.
        kill_every: period at which a worker is killed [s]; zero kills none.
    """
    seconds = 60 * minutes if name == "mixed" else min(LONGEST_CROWD, 60 * minutes)
    with running() as service:
        phases = [
            observed(service, "before", alone),
            observed(
                service, "during", lambda: asyncio.run(crowd(service, name, seconds, kill_every))
            ),
        ]
        time.sleep(SETTLING)
        phases.append(observed(service, "after", alone))
        print(HEAD)
        for phase in phases:
            print(line(name, phase), flush=True)
        service.log.seek(0)
        log = service.log.read()
    counts = [f"{log.count(text.encode())} × {text}" for text in COUNTED_MESSAGES]
    print("in the log: " + ", ".join(counts), flush=True)
    return phases
