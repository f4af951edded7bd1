"""Proven gap, 1 - lower bound / energy, of random requests with the normal and the tight bound, and what it takes."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from app.convert.request import to_problem
from app.schemas.request import OptimizeRequest
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from benchmarks.tasks import move, request_task
from models.registry import load_robot
from optimizer.energy.kernel_cache import compile_kernel
from optimizer.exceptions import JoulepathError
from optimizer.optimize import optimize
from optimizer.problem.arm import Arm
from optimizer.problem.problem import Problem
from optimizer.solution import Solution

KINDS = ("joint to joint", "joint to pose")


def task(kind: str, seed: int, index: int, deadline: float) -> Problem:
    """Task `index` of a seed; joint to joint without regard to collisions."""
    if kind == "joint to joint":
        ends = move(seed, index)
        arm = Arm(robot=load_robot("ur5e"), collisions=False)
        return Problem(arm=arm, start=ends.q_start, goal=ends.q_goal, deadline=deadline)
    return to_problem(OptimizeRequest(**request_task(seed, index, "joint to pose").body), deadline)


def gap(solution: Solution) -> float:
    """1 - lower bound / energy."""
    return 1 - solution.lower_bound / solution.energy.electrical.total


def main() -> None:
    """Solves every task twice and compares the gaps."""
    arguments = parser(__doc__, seed=2)
    arguments.add_argument("--count", type=int, default=20, help="tasks of each kind (%(default)s)")
    arguments.add_argument("--deadline", type=float, default=30.0, help="deadline of a request [s] (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    results: dict[str, object] = {"seed": given.seed, "count": given.count}
    for kind in KINDS:
        before, after, extra = [], [], []
        for index in range(given.count):
            problem = task(kind, given.seed, index, given.deadline)
            try:
                began = time.perf_counter()
                normal = optimize(problem)
                between = time.perf_counter()
                tight = optimize(replace(problem, bound="tight"))
            except JoulepathError as error:
                print(f"index {index}: {error!r}")
                continue
            extra.append(time.perf_counter() - 2 * between + began)
            before.append(gap(normal))
            after.append(gap(tight))
        spreads = {"normal": Spread.of(before), "tight": Spread.of(after), "extra_time": Spread.of(extra)}
        results[kind] = spreads
        for name, gaps in (("normal", before), ("tight", after)):
            print(
                f"{kind}, {name} bound: gap median {np.median(gaps):.1%}, 90th percentile {np.quantile(gaps, 0.9):.1%}"
            )
        print(f"{kind}, time for the tight one: {spreads['extra_time'].formatted(' s', 2)}")
    write_json(given.json, results)


if __name__ == "__main__":
    main()
