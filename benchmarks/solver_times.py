"""Time of one candidate, joint to joint, on one core: the free B-spline and the time-scaled line.

Timed is `optimizer.candidate.Solver` alone, from the two configurations to a motion that holds every limit between the
nodes too; not the refinement of the winner, the baselines or the certificate.
"""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

from benchmarks.command import keep, on_one_core, parser
from benchmarks.figures import Spread
from benchmarks.tasks import Move, moves
from models.registry import load_robot
from optimizer.candidate import Attempt
from optimizer.kernel import compile_kernel
from optimizer.methods import solver_for
from optimizer.motion import Task
from optimizer.optimize import warm_up
from optimizer.problem import Method, Problem

PATIENCE = 60.0  # s
METHODS: tuple[Method, ...] = ("bspline", "time_scaling")


def solve(move: Move, method: Method) -> tuple[float, Attempt]:
    """Wall time [s] and outcome of one candidate."""
    task = Task(Problem(move.q_start, move.q_goal, method=method, collisions=False))
    began = time.perf_counter()
    outcome = solver_for(task, move.q_start, move.q_goal, began + PATIENCE).solve()
    return time.perf_counter() - began, outcome


def measure(seed: int, count: int, method: Method) -> dict[str, Any]:
    """All tasks of a seed by one method."""
    solve(next(moves(seed, 1)), method)
    runs = [(move, *solve(move, method)) for move in moves(seed, count)]
    return {
        "wall": Spread.of([wall for _, wall, _ in runs]),
        "iterations": Spread.of([outcome.iterations for _, _, outcome in runs]),
        "statuses": dict(Counter(outcome.status for _, _, outcome in runs)),
        "unsolved": [f"seed {move.seed} index {move.index}" for move, _, o in runs if o.status != "solved"],
    }


def main() -> None:
    """Measure both methods."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=200, help="tasks (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    warm_up("ur5e")
    figures: dict[str, Any] = {method: measure(given.seed, given.count, method) for method in METHODS}
    for method, found in figures.items():
        print(f"{method:13s} {found['wall'].times(1e3).told(' ms')}, iterations {found['iterations'].told('', 0)}")
        print(f"{'':13s} {found['statuses']} {', '.join(found['unsolved'])}")
    keep(given.json, figures)


if __name__ == "__main__":
    main()
