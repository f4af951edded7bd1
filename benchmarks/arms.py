"""Random requests from joint positions to a pose, for every robot: certified motions, or refusals
with a true reason.

    python -m benchmarks.arms --count 10
    python -m benchmarks.arms --count 200 --robots panda gen3
    python -m benchmarks.arms ~/ros/src/*_description/urdf/*.urdf --packages ~/ros/src

Without files, the command starts the service with its default settings and sends the same number of
requests for every robot. Answers are checked as in `benchmarks.requests`. Start and goal of a
request are free of collisions, so that the only true reason for a refusal is that the motors cannot
hold the arm there. The exit code is 1 if an answer or a refusal is wrong.

With URDF files, or files with xacro macros, the command prints one line per file: the reason of a
refusal, or the inverse kinematics of the arm and one certified motion from pose to pose, exported
for ROS 2 (see `arm_files`). `--arguments` has values for the arguments of macros. The exit code is
1 if reading or solving raises an undeclared error.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.arm_files import ArmOutcome, first_motion
from benchmarks.checks import refusal_errors
from benchmarks.command import parser, verdict, write_json
from benchmarks.requests import Outcome, send_all
from benchmarks.service import Service, running
from benchmarks.statistics import Spread
from benchmarks.tasks import Kind, request_tasks
from joulepath.models.registry import robot_names
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.problem.robots import load_robot

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


def of_robot(service: Service, name: str, seed: int, count: int) -> dict[str, Any]:
    """Sends the requests for one robot, after a first request that makes the worker load it."""
    tasks = list(request_tasks(seed, count, KIND, robot=name))
    send_all(service, tasks[:1])
    return row(name, send_all(service, tasks))


def of_files(given: argparse.Namespace) -> int:
    """Prints a line per URDF file, and the counts."""
    outcomes = list[ArmOutcome]()
    arguments = dict(each.split("=", 1) for each in given.arguments)
    failed = 0
    for file in given.files:
        try:
            outcomes.append(first_motion(file, given.packages, arguments, given.seed))
            print(outcomes[-1], flush=True)
        except Exception as error:
            failed += 1
            print(f"FAILED: {file}: {type(error).__name__}: {error}", flush=True)
    read = sum(each.is_read for each in outcomes)
    answered = sum(bool(each.status) for each in outcomes)
    print(f"{read} of {len(given.files)} files read, {answered} answered, {failed} failed")
    write_json(given.json, {"outcomes": outcomes})
    return 1 if failed else 0


def main() -> int:
    """Runs the requests and prints a line per robot."""
    arguments = parser(__doc__, seed=4)
    arguments.add_argument("files", nargs="*", type=Path, help="URDF files, or files with macros")
    arguments.add_argument(
        "--packages", nargs="+", type=Path, default=[], help="folders with ROS packages"
    )
    arguments.add_argument(
        "--arguments", nargs="+", default=[], metavar="NAME=VALUE", help="arguments of macros"
    )
    arguments.add_argument("--count", type=int, default=10, help="requests per robot (%(default)s)")
    arguments.add_argument(
        "--robots", nargs="+", choices=robot_names(), default=robot_names(), help="robots (all)"
    )
    given = arguments.parse_args()
    if given.files:
        return of_files(given)
    for name in given.robots:
        compile_kernel(load_robot(name))
    rows = []
    with running(JOULEPATH_WORKERS="1") as service:
        for name in given.robots:
            one = of_robot(service, name, given.seed, given.count)
            rows.append(one)
            print(
                f"{name:11s} {one['answered']:3d} of {one['count']} answered, {len(one['errors'])} "
                f"errors, gap median {one['gap'].p50:5.1%}, time median {one['wall'].p50:.2f} s, "
                f"95th percentile {one['wall'].p95:.2f} s",
                flush=True,
            )
    errors = [error for one in rows for error in one["errors"]]
    results = {"count": given.count, "rows": rows, "errors": errors}
    return verdict(given.json, results, errors)


if __name__ == "__main__":
    sys.exit(main())
