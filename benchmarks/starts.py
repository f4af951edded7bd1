"""Times of the first request after a start with a warm and a cold cache, and of requests while the kernel compiles."""

from __future__ import annotations

import http.client
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.command import parser, write_json
from benchmarks.service import Answer, Service, running
from benchmarks.statistics import Spread
from benchmarks.tasks import request_task
from joulepath.models.registry import load_robot, robot_names
from joulepath.optimizer.energy.kernel_cache import compile_kernel

PATIENCE = 90.0  # longest time for the first answer, and for the compiler [s]
AFTER = 10  # measured requests after the kernel is compiled


def first_answer(service: Service, body: dict[str, Any]) -> Answer:
    """The answer to a request that is sent as soon as the port accepts connections."""
    client = service.client()
    while True:
        try:
            return client.optimize(body)
        except (OSError, http.client.HTTPException):
            if service.age > PATIENCE or service.process.poll() is not None:
                raise
            time.sleep(0.005)


def warm(seed: int, robot: str) -> dict[str, Any]:
    """Times with compiled kernels in the cache: a request sent at once, and one sent after `/readyz` answers 200."""
    compile_kernel(load_robot(robot))
    body = request_task(seed, 0, robot=robot).body
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


def cold(seed: int, robot: str) -> dict[str, Any]:
    """Times with an empty cache: sequential requests before and after the kernel is compiled."""
    with tempfile.TemporaryDirectory() as cache, running(ready=False, JOULEPATH_CACHE_DIR=cache) as service:
        body = request_task(seed, 0, robot=robot).body
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
            answer = client.optimize(request_task(seed, index, robot=robot).body)
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
    """Measures both."""
    arguments = parser(__doc__)
    arguments.add_argument("--robot", choices=robot_names(), default="ur5e", help="(%(default)s)")
    given = arguments.parse_args()
    results = {"warm": warm(given.seed, given.robot), "cold": cold(given.seed, given.robot)}
    one = results["warm"]
    print(
        f"warm cache: ready after {one['start_to_ready']:.2f} s, first request then {one['first_after_ready']:.3f} s "
        f"(the same again {one['second']:.3f} s); sent at once, answered {one['start_to_answer']:.2f} s after the start"
    )
    other = results["cold"]
    print(
        f"cold cache: first answer {other['start_to_answer']:.2f} s after the start, kernel compiled after "
        f"{other['compiled_after'] or float('nan'):.2f} s, {other['answered_meanwhile']} requests answered meanwhile "
        f"({other['wall_meanwhile'].formatted(' s', 2)}), afterwards {other['wall_afterwards'].formatted(' s', 2)}"
    )
    write_json(given.json, results)


if __name__ == "__main__":
    main()
