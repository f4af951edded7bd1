"""Crowds of clients on a service of their own: those that leave early, those with tight deadlines,
all kinds at once.

An honest client optimises short motions before, during and after; beside it, one asks for
`/healthz`. Wanted: no status 500, all workers there afterwards, and an honest client that keeps a
third of the answers that it gets alone.
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
from benchmarks.observed_attack import beside, honest, probe
from benchmarks.service import Service, running

ADDRESSES = [f"127.0.0.{k}" for k in range(66, 70)]  # of the crowd: each is a client of its own
ALONE = 15.0  # time for which the honest client is alone, before and after [s]
SETTLING = 5.0  # from the end of a crowd until all workers are to be there again [s]
SHORT = 30.0  # time of a crowd, but for the mixed one [s]
LEAVING = 0.05  # after which an impatient client leaves [s]
HURRY = 1.0  # the same of a hurried one, which comes again [s]
TIGHT = 2.0  # deadline of those that wait for their answers [s]
PATIENCE = 60.0  # longest time for an answer [s]
HEAD = (
    "| crowd | phase | s | honest 200 per s | honest other | crowd | workers | /readyz | /healthz "
    "p99, ms | most |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)
NOTED = ('"traceback"', "mended the queue", "did not end in time", "begins again")
LEFT = 0  # in place of the status of a client that did not wait for one


@dataclass(frozen=True)
class Phase:
    """What was seen in a phase of `time` [s]: statuses of the honest client and of the crowd,
    workers and `/readyz` at its end, times for `/healthz` [ms]."""

    name: str
    time: float
    honest: dict[int, int]
    crowd: dict[int, int]
    workers: int
    ready: int
    healthz_p99: float
    healthz_most: float


async def ask(
    port: int, address: str, path: str, body: dict[str, Any], longest: float = PATIENCE
) -> int:
    """The status of the answer; LEFT if that takes longer [s] than the client waits."""
    content = orjson.dumps(body)
    head = (
        f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nConnection: "
        "close\r\n"
        f"Cache-Control: no-cache\r\nContent-Length: {len(content)}\r\n\r\n"
    )
    reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(address, 0))
    try:
        writer.write(head.encode() + content)
        async with asyncio.timeout(longest):
            status = int((await reader.readline()).split()[1])
            while await reader.read(1 << 16):
                pass
            return status
    except (TimeoutError, OSError, IndexError):
        return LEFT
    finally:
        writer.transport.abort()


async def impatient(port: int, address: str, rng: random.Random) -> int:
    """A client that leaves at once."""
    return await ask(port, address, "/optimize", move(), LEAVING)


async def patient(port: int, address: str, rng: random.Random) -> int:
    """A client that waits for its answer."""
    return await ask(port, address, "/optimize", move())


async def hurried(port: int, address: str, rng: random.Random) -> int:
    """A client that waits for less time than its turn takes."""
    return await ask(port, address, "/optimize", move(), HURRY)


async def tight(port: int, address: str, rng: random.Random) -> int:
    """A client that waits for its answer, which is due soon."""
    status = await ask(port, address, "/optimize", move() | {"deadline": TIGHT})
    await asyncio.sleep(0.1 if status in (429, 503) else 0.0)
    return status


async def mixed(port: int, address: str, rng: random.Random) -> int:
    """Any client: short and long requests, some that leave, jobs, inverse kinematics."""
    pose = {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]}
    path, body = rng.choice(
        [
            ("/optimize", move()),
            ("/optimize", move() | {"deadline": rng.choice([0.2, 1.0, TIGHT])}),
            ("/optimize", long_search(rng.choice([TIGHT, 5.0]))),
            ("/ik", {"pose": pose}),
            ("/pareto", {**move(), "points": 3, "deadline": 5.0}),
            ("/jobs", {"requests": [{"optimize": move() | {"deadline": 5.0}}]}),
        ]
    )
    status = await ask(
        port, address, path, body, rng.choice([LEAVING, 0.3, 1.0, PATIENCE, PATIENCE])
    )
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
"""Each crowd: what one of its connections does again and again, how many there are, and from how
many addresses.
"""


async def crowd(service: Service, name: str, seconds: float, kill_every: float) -> Counter[int]:
    """How often each status was answered to the crowd; workers are killed meanwhile if a period [s]
    is given.
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
    """Process ids of the workers: what the fork server has started."""
    children = (
        Path(f"/proc/{service.process.pid}/task/{service.process.pid}/children").read_text().split()
    )
    pids = service.worker_pids()
    return [pid for pid in pids if str(pid) not in children]


def observed(service: Service, name: str, attack: Callable[[], Counter[int]]) -> Phase:
    """What is seen while `attack` runs."""
    with beside(probe, service.port) as end_probe, beside(honest, service.port) as end_honest:
        began = time.perf_counter()
        seen = attack()
        taken = time.perf_counter() - began
        walls, answers = end_probe(), end_honest()
    metrics = service.client().get("/metrics").raw.decode()
    workers = next(
        line for line in metrics.splitlines() if line.startswith("joulepath_workers_warm ")
    )
    return Phase(
        name,
        taken,
        dict(Counter(status for status, _ in answers)),
        dict(seen),
        int(float(workers.split()[1])),
        service.client().get("/readyz").status,
        float(np.percentile(walls, 99)) * 1e3,
        max(walls) * 1e3,
    )


def alone() -> Counter[int]:
    """Nobody but the honest client."""
    time.sleep(ALONE)
    return Counter()


def line(name: str, phase: Phase) -> str:
    """A row of the table."""
    share = phase.honest.get(200, 0) / phase.time
    crowd = ", ".join(
        f"{count} × {status or 'left'}" for status, count in sorted(phase.crowd.items())
    )
    others = ", ".join(
        f"{count} × {status}" for status, count in sorted(phase.honest.items()) if status != 200
    )
    return (
        f"| {name} | {phase.name} | {phase.time:.0f} | {share:.2f} | {others} | {crowd} | "
        f"{phase.workers} | {phase.ready} | {phase.healthz_p99:.0f} | {phase.healthz_most:.0f} |"
    )


def report(name: str, minutes: float, kill_every: float) -> list[Phase]:
    """The phases of a crowd on a new service, which are printed, too. The mixed crowd takes so long
    [min].
    """
    seconds = 60 * minutes if name == "mixed" else min(SHORT, 60 * minutes)
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
    noted = {word: log.count(word.encode()) for word in NOTED}
    print(
        "in the log: " + ", ".join(f"{count} × {word}" for word, count in noted.items()), flush=True
    )
    return phases
