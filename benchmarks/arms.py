"""Every robot: random requests from joint positions to a pose. Each gets a certified motion, or a
reason that is true.

    python -m benchmarks.arms --count 10
    python -m benchmarks.arms --count 200 --robots panda gen3

Starts the service with its default settings and sends the same number of requests for each robot.
Answers are checked as in `benchmarks.requests`. Both ends of a request are drawn free of
collisions, so that there is one true reason to refuse it: that the motors cannot hold the arm
there. The exit code is 1 if an answer or a refusal is wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from benchmarks.checks import refusal_errors
from benchmarks.command import parser, write_json
from benchmarks.requests import Outcome, send_all
from benchmarks.service import Service, running
from benchmarks.statistics import Spread
from benchmarks.tasks import Kind, request_tasks
from joulepath.models.registry import load_robot, robot_names
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel

KIND: Kind = "joint to pose"


def row(name: str, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Statistics of one robot's requests."""
    solved = [each for each in outcomes if each.status == 200]
    errors = [f"{name}, {each.name}: {error}" for each in outcomes for error in each.errors]
    for each in outcomes:
        if each.problem and not each.errors:
            found = refusal_errors(
                load_robot(name), each.problem, each.task.q_start, each.task.q_goal
            )
            errors += [f"{name}, {each.name}: {error}" for error in found]
    return {
        "robot": name,
        "joints": load_robot(name).nq,
        "count": len(outcomes),
        "answered": len(solved),
        "errors": errors,
        "gap": Spread.of([each.gap for each in solved]),
        "wall": Spread.of([each.wall for each in solved]),
        "solves": Spread.of([each.solves for each in solved]),
    }


def of_robot(
    service: Service, name: str, seed: int, count: int, deadline: float | None
) -> dict[str, Any]:
    """Sends the requests of one robot, the first of them twice, so that a worker has loaded what
    they need.
    """
    tasks = list(request_tasks(seed, count, KIND, robot=name))
    if deadline is not None:
        for task in tasks:
            task.body["deadline"] = deadline
    send_all(service, tasks[:1])
    return row(name, send_all(service, tasks))


def main() -> int:
    """Runs the requests and prints a line per robot."""
    arguments = parser(__doc__, seed=4)
    arguments.add_argument("--count", type=int, default=10, help="requests per robot (%(default)s)")
    arguments.add_argument(
        "--robots", nargs="+", choices=robot_names(), default=robot_names(), help="(all)"
    )
    arguments.add_argument("--deadline", type=float, help="of each request [s] (the service's)")
    given = arguments.parse_args()
    for name in given.robots:
        compile_kernel(load_robot(name))
    rows = []
    with running(JOULEPATH_WORKERS="1") as service:
        for name in given.robots:
            one = of_robot(service, name, given.seed, given.count, given.deadline)
            rows.append(one)
            print(
                f"{name:11s} {one['answered']:3d} of {one['count']} answered, {len(one['errors'])} "
                f"errors, gap median {one['gap'].p50:5.1%}, time median {one['wall'].p50:.2f} s, "
                f"95th percentile {one['wall'].p95:.2f} s",
                flush=True,
            )
    errors = [error for one in rows for error in one["errors"]]
    for error in errors:
        print(f"FAILED: {error}")
    write_json(given.json, {"count": given.count, "rows": rows, "errors": errors})
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
