"""The service under steady load: clients that each send their next request as soon as the last is answered.

Then a burst of more requests than workers and queue can take, all at once: those beyond must be refused with 503.
"""

from __future__ import annotations

import os
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.command import keep, parser
from benchmarks.figures import Spread
from benchmarks.service import Client, Service, resident, running
from benchmarks.tasks import ask

PERIOD = 1.0  # between two looks at memory [s]
BURST = 40  # requests at once
VALID = b'"certificate"'


@dataclass
class Record:
    """What the clients saw; `waiting` is the most requests under way at once."""

    walls: list[float] = field(default_factory=list)
    statuses: Counter[int] = field(default_factory=Counter)
    lost: list[str] = field(default_factory=list)
    under_way: int = 0
    most_under_way: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def exchange(self, client: Client, body: dict[str, Any]) -> None:
        """One request."""
        with self.lock:
            self.under_way += 1
            self.most_under_way = max(self.most_under_way, self.under_way)
        try:
            answer = client.optimize(body)
        except Exception as error:  # whatever it is, the answer is lost
            with self.lock:
                self.lost.append(repr(error))
            return
        finally:
            with self.lock:
                self.under_way -= 1
        with self.lock:
            valid = answer.status != 200 or VALID in answer.raw
            self.statuses[answer.status if valid else -1] += 1
            self.walls.append(answer.wall)


def steady(service: Service, seed: int, clients: int, seconds: float) -> dict[str, Any]:
    """`clients` for some time; each has tasks of its own."""
    record, end = Record(), time.perf_counter() + seconds
    workers = service.worker_pids()
    memory: list[float] = []

    def one(number: int) -> None:
        client, index = service.client(), number
        while time.perf_counter() < end:
            record.exchange(client, ask(seed, index).body)
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
        "most_under_way": record.most_under_way,
        "wall": Spread.of(record.walls),
        "memory": memory,
        "memory_first": float(np.median(memory[quarter : 2 * quarter] or memory)),
        "memory_last": float(np.median(memory[-quarter:])),
        "same_workers": workers == service.worker_pids(),
        "processes": len(workers),
        "cores": len(os.sched_getaffinity(0)),
    }


def burst(service: Service, seed: int) -> dict[str, Any]:
    """BURST requests at once."""
    bodies = [ask(seed, index).body for index in range(BURST)]

    def one(body: dict[str, Any]) -> tuple[int, bool]:
        answer = service.client().optimize(body)
        return answer.status, "retry-after" in answer.headers

    with ThreadPoolExecutor(BURST) as threads:
        answers = list(threads.map(one, bodies))
    return {
        "sent": BURST,
        "statuses": {str(s): n for s, n in Counter(status for status, _ in answers).items()},
        "refusals_say_when": all(told for status, told in answers if status == 503),
    }


def main() -> None:
    """Load, then burst."""
    arguments = parser(__doc__, seed=7)
    arguments.add_argument("--clients", type=int, default=8, help="at a time (%(default)s)")
    arguments.add_argument("--seconds", type=float, default=60.0, help="how long (%(default)s)")
    given = arguments.parse_args()
    with running() as service:
        figures = steady(service, given.seed, given.clients, given.seconds)
        figures["burst"] = burst(service, given.seed)
    wall = figures["wall"]
    print(
        f"{figures['clients']} clients for {figures['seconds']:.0f} s: {figures['answers']} answers, "
        f"{figures['per_second']:.1f} per second, {figures['statuses']}, lost {figures['lost'] or 'none'}"
    )
    print(f"wall {wall.times(1e3).told(' ms', 0)}, p99 {wall.p99 * 1e3:.0f} ms = {wall.p99 / wall.p50:.1f} × p50")
    print(
        f"memory of {figures['processes']} processes, MiB: second quarter {figures['memory_first']:.0f}, "
        f"last {figures['memory_last']:.0f}; same processes throughout: {figures['same_workers']}"
    )
    print(f"burst: {figures['burst']}")
    keep(given.json, figures)


if __name__ == "__main__":
    main()
