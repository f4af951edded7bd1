"""Effects of an attack on a service: memory of its main process, response times of `/healthz`, and
answers to an honest client.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from benchmarks.attack_bodies import move
from benchmarks.service import Client, Service, resident

HONEST = "127.0.0.1"
"""Address of the client with valid requests."""
PROBE = "127.0.0.2"
"""Address of the client that requests `/healthz`."""
PROBE_PERIOD = 0.025
"""Time between two requests of `/healthz` [s]."""
SETTLING = 3.0
"""Time from the end of an attack to the last measurement of memory [s]."""

Attack = Callable[[int], Awaitable[str]]


@dataclass(frozen=True)
class Outcome:
    """Memory of the main process before, during and after an attack [MiB], response times of
    `/healthz` [ms], numbers of answers and refusals to the honest client and its longest response
    time [s], and the attacker's own observations `seen`.
    """

    attack: str
    before: float
    peak: float
    after: float
    healthz_p99: float
    healthz_most: float
    answered: int
    refused: int
    honest_most: float
    seen: str


def probe(port: int, pipe: Connection) -> None:
    """Measures the response times of `/healthz` [s].

    Sends a message to the pipe at the start, and the times when the other end writes to the pipe.
    """
    walls: list[float] = []
    client = Client(port, PROBE)
    pipe.send(None)
    while not walls or not pipe.poll(PROBE_PERIOD):
        began = time.perf_counter()
        with contextlib.suppress(Exception):
            client.get("/healthz")
        walls.append(time.perf_counter() - began)
    pipe.send(walls)


def honest(port: int, pipe: Connection) -> None:
    """Records status and response time [s] of every request of a client that waits for its answers.

    The pipe is used as in `probe`.
    """
    answers: list[tuple[int, float]] = []
    client = Client(port, HONEST)
    pipe.send(None)
    while not answers or not pipe.poll(0.1):
        began = time.perf_counter()
        try:
            status = client.optimize(move()).status
        except Exception:  # every failure counts as a lost answer
            status = 0
        answers.append((status, time.perf_counter() - began))
    pipe.send(answers)


@contextmanager
def in_parallel(
    target: Callable[[int, Connection], None], port: int
) -> Iterator[Callable[[], list[Any]]]:
    """Runs `target` in another process, so that it does not wait for the attacker.

    The value of the context is a function that ends `target` and returns its result.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=target, args=(port, theirs), daemon=True)
    process.start()
    # on a busy machine, the start of a process may take longer than an attack
    ours.recv()

    def end() -> list[Any]:
        ours.send(None)
        result: list[Any] = ours.recv()
        return result

    try:
        yield end
    finally:
        process.kill()


def observed(name: str, attack: Attack, service: Service) -> Outcome:
    """The attack's outcome."""
    pid = service.process.pid
    memory = [resident(pid)]

    async def run() -> str:
        async def measure() -> None:
            while True:
                memory.append(resident(pid))
                await asyncio.sleep(0.05)

        measuring = asyncio.create_task(measure())
        try:
            return await attack(service.port)
        finally:
            measuring.cancel()

    port = service.port
    with in_parallel(probe, port) as end_probe, in_parallel(honest, port) as end_honest:
        time.sleep(2.0)
        seen = asyncio.run(run())
        walls, answers = end_probe(), end_honest()
    time.sleep(SETTLING)
    return Outcome(
        name,
        memory[0],
        max(memory),
        resident(pid),
        float(np.percentile(walls, 99)) * 1e3,
        max(walls) * 1e3,
        sum(status == 200 for status, _ in answers),
        sum(status != 200 for status, _ in answers),
        max((wall for _, wall in answers), default=0.0),
        seen,
    )
