"""Time of one candidate, joint to joint, on one core: the free B-spline and the time-scaled line.

The time covers the method alone: from two configurations to a motion that is within all limits,
also between the nodes. It does not include the refinement of the incumbent, the baselines and the
certificate. If start and goal are free of self-collisions, the B-spline is also timed with
self-collision constraints, alternately with and without them.
"""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread
from benchmarks.tasks import Move, moves
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.optimize import warm_up
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveResult

SOLVE_TIME = 60.0
"""Longest time of one solve [s]."""
METHODS: tuple[MethodName, ...] = ("bspline", "time_scaling")


def solve(move: Move, method: MethodName, collisions: bool = False) -> tuple[float, SolveResult]:
    """Wall time [s] and result of one candidate."""
    task = PreparedProblem.of(
        Problem(
            arm=Arm(robot=load_robot("ur5e"), collisions=collisions),
            start=move.q_start,
            goal=move.q_goal,
            method=method,
        )
    )
    began = time.perf_counter()
    outcome = solver_for(
        SolveContext.of(task, move.q_start, move.q_goal, Deadline.after(SOLVE_TIME))
    ).solve()
    return time.perf_counter() - began, outcome


def measure(seed: int, count: int, method: MethodName) -> dict[str, Any]:
    """Statistics of all tasks of a seed by one method."""
    solve(next(moves(seed, 1)), method)
    runs = [(move, *solve(move, method)) for move in moves(seed, count)]
    return {
        "wall": Spread.of([wall for _, wall, _ in runs]),
        "iterations": Spread.of([outcome.iterations for _, _, outcome in runs]),
        "statuses": dict(Counter(outcome.status.value for _, _, outcome in runs)),
        "unsolved": [
            f"seed {move.seed} index {move.index}" for move, _, o in runs if o.spline is None
        ],
    }


def with_self_collision(seed: int, count: int) -> dict[str, Any]:
    """Statistics of the time with self-collision constraints, and of its ratio to the time without
    them."""
    model = CollisionModel(Arm(robot=load_robot("ur5e")))
    ratios, walls = [], []
    for move in moves(seed, count):
        if (
            model.least_distance(
                np.stack([move.q_start, move.q_goal]), CLEARANCE_CONSTRAINT.reserve
            )
            <= CLEARANCE_CONSTRAINT.reserve
        ):
            continue
        without, with_links = (
            solve(move, "bspline", collisions)[0] for collisions in (False, True)
        )
        ratios.append(with_links / without)
        walls.append(with_links)
    return {"wall": Spread.of(walls), "ratio": Spread.of(ratios)}


def main() -> None:
    """Measures both methods, and the effect of self-collision constraints."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=200, help="tasks (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    warm_up("ur5e")
    results: dict[str, Any] = {
        method: measure(given.seed, given.count, method) for method in METHODS
    }
    for method, found in results.items():
        print(f"{method:13s} time {found['wall'].times(1e3).formatted(' ms')}")
        print(f"{method:13s} iterations {found['iterations'].formatted('', 0)}")
        print(f"{'':13s} {found['statuses']} {', '.join(found['unsolved'])}")
    results["self_collision"] = found = with_self_collision(given.seed, given.count)
    print(f"bspline with self-collision constraints: {found['wall'].times(1e3).formatted(' ms')}")
    print(f"    ratio to the time without: {found['ratio'].formatted('', 2)}")
    write_json(given.json, results)


if __name__ == "__main__":
    main()
