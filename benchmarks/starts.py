"""The first request after a start, on a warm cache and a cold one, and what is answered while the kernel compiles."""

from __future__ import annotations

import http.client
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.command import keep, parser
from benchmarks.figures import Spread
from benchmarks.service import Answer, Service, running
from benchmarks.tasks import ask
from models.registry import load_robot
from optimizer.energy.kernel_cache import compile_kernel

PATIENCE = 90.0  # for the first answer, and for the compiler [s]
AFTER = 10  # requests answered by the compiled kernel that are measured


def first_answer(service: Service, body: dict[str, Any]) -> Answer:
    """The answer to a request that is sent as soon as the port is open."""
    client = service.client()
    while True:
        try:
            return client.optimize(body)
        except (OSError, http.client.HTTPException):
            if service.age > PATIENCE or service.process.poll() is not None:
                raise
            time.sleep(0.005)


def warm(seed: int) -> dict[str, Any]:
    """Starts with compiled kernels in the cache: once for a request at once, once for one after `/readyz`."""
    compile_kernel(load_robot("ur5e"))
    body = ask(seed, 0).body
    with running(ready=False) as service:
        at_once = first_answer(service, body)
        answered = service.age
    with running() as service:
        ready = service.age
        after_ready = service.client().optimize(body)
        second = service.client().optimize(body)
    return {
        "start_to_answer": answered,
        "start_to_ready": ready,
        "first_after_ready": after_ready.wall,
        "second": second.wall,
        "statuses": [at_once.status, after_ready.status, second.status],
    }


def cold(seed: int) -> dict[str, Any]:
    """A start with an empty cache: requests one after another, before and after the compiled kernel is there."""
    with tempfile.TemporaryDirectory() as cache, running(ready=False, JOULEPATH_CACHE_DIR=cache) as service:
        body = ask(seed, 0).body
        first = first_answer(service, body)
        answered, ready = service.age, None
        compiled: float | None = None
        before, statuses = [first.wall], [first.status]
        after: list[float] = []
        client, index = service.client(), 0
        while len(after) < AFTER and service.age < PATIENCE:
            if compiled is None and any(Path(cache).glob("*.so")):
                compiled = service.age
            if ready is None and client.get("/readyz").status == 200:
                ready = service.age
            index += 1
            answer = client.optimize(ask(seed, index).body)
            statuses.append(answer.status)
            (before if compiled is None else after).append(answer.wall)
        return {
            "start_to_answer": answered,
            "start_to_ready": ready,
            "compiled_after": compiled,
            "answered_meanwhile": len(before),
            "wall_meanwhile": Spread.of(before),
            "wall_afterwards": Spread.of(after),
            "all_answered": all(status == 200 for status in statuses),
        }


def main() -> None:
    """Measure both."""
    given = parser(__doc__).parse_args()
    figures = {"warm": warm(given.seed), "cold": cold(given.seed)}
    one = figures["warm"]
    print(
        f"warm cache: ready after {one['start_to_ready']:.2f} s, first request then {one['first_after_ready']:.3f} s "
        f"(the same again {one['second']:.3f} s); sent at once, answered {one['start_to_answer']:.2f} s after the start"
    )
    other = figures["cold"]
    print(
        f"cold cache: first answer {other['start_to_answer']:.2f} s after the start, kernel compiled after "
        f"{other['compiled_after'] or float('nan'):.2f} s, {other['answered_meanwhile']} requests answered meanwhile "
        f"({other['wall_meanwhile'].told(' s', 2)}), afterwards {other['wall_afterwards'].told(' s', 2)}"
    )
    keep(given.json, figures)


if __name__ == "__main__":
    main()
