"""The service under steady load: every client sends its next request as soon as it has the answer
to the previous one.
"""

from __future__ import annotations

import os
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.command import parser, write_json
from benchmarks.service import Client, Service, resident, running
from benchmarks.statistics import Spread
from benchmarks.tasks import request_task

PERIOD = 1.0
"""Time between two measurements of memory [s]."""
VALID = b'"certificate"'
"""Part of every valid answer."""


@dataclass
class Record:
    """Results of all clients: wall times [s], statuses, errors of lost requests, and the largest
    number of simultaneous requests.
    """

    walls: list[float] = field(default_factory=list)
    statuses: Counter[int] = field(default_factory=Counter)
    lost: list[str] = field(default_factory=list)
    in_flight: int = 0
    most_in_flight: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def exchange(self, client: Client, body: dict[str, Any]) -> None:
        """Sends one request and records its result."""
        with self.lock:
            self.in_flight += 1
            self.most_in_flight = max(self.most_in_flight, self.in_flight)
        try:
            answer = client.optimize(body)
        except Exception as error:  # every failure counts as a lost answer
            with self.lock:
                self.lost.append(repr(error))
            return
        finally:
            with self.lock:
                self.in_flight -= 1
        with self.lock:
            valid = answer.status != 200 or VALID in answer.raw
            self.statuses[answer.status if valid else -1] += 1
            self.walls.append(answer.wall)


def steady(service: Service, seed: int, clients: int, seconds: float) -> dict[str, Any]:
    """Results of `clients` clients over `seconds`; no two clients have the same tasks."""
    record, end = Record(), time.perf_counter() + seconds
    workers = service.worker_pids()
    memory: list[float] = []

    def one(number: int) -> None:
        client, index = service.client(), number
        while time.perf_counter() < end:
            record.exchange(client, request_task(seed, index).body)
            index += clients

    threads = [threading.Thread(target=one, args=(number,)) for number in range(clients)]
    began = time.perf_counter()
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        memory.append(sum(resident(pid) for pid in workers))
        time.sleep(PERIOD)
    elapsed = time.perf_counter() - began
    quarter = max(len(memory) // 4, 1)
    return {
        "clients": clients,
        "seconds": elapsed,
        "answers": len(record.walls),
        "per_second": len(record.walls) / elapsed,
        "statuses": {str(status): count for status, count in record.statuses.items()},
        "lost": record.lost,
        "most_in_flight": record.most_in_flight,
        "wall": Spread.of(record.walls),
        "memory": memory,
        "memory_first": float(np.median(memory[quarter : 2 * quarter] or memory)),
        "memory_last": float(np.median(memory[-quarter:])),
        "same_workers": workers == service.worker_pids(),
        "processes": len(workers),
        "cores": len(os.sched_getaffinity(0)),
    }


def main() -> None:
    """Runs the load."""
    arguments = parser(__doc__, seed=7)
    arguments.add_argument("--clients", type=int, default=8, help="clients (%(default)s)")
    arguments.add_argument("--seconds", type=float, default=60.0, help="duration [s] (%(default)s)")
    given = arguments.parse_args()
    with running() as service:
        results = steady(service, given.seed, given.clients, given.seconds)
    wall = results["wall"]
    print(
        f"{results['clients']} clients for {results['seconds']:.0f} s: {results['answers']} "
        f"answers, {results['per_second']:.1f} per second, {results['statuses']}, lost "
        f"{results['lost'] or 'none'}"
    )
    print(f"wall {wall.times(1e3).formatted(' ms', 0)}")
    print(f"99th percentile {wall.p99 * 1e3:.0f} ms = {wall.p99 / wall.p50:.1f} × median")
    print(
        f"memory of {results['processes']} processes, MiB: second quarter "
        f"{results['memory_first']:.0f}, last {results['memory_last']:.0f}; same processes "
        f"throughout: {results['same_workers']}"
    )
    write_json(given.json, results)


if __name__ == "__main__":
    main()
