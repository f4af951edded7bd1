"""Energies of answers relative to the reference energies of `benchmarks.reference`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.reference import fingerprint, load, problem_of
from benchmarks.statistics import Spread
from benchmarks.tasks import move
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.robots import load_robot

UNREACHED_DEADLINE = 600.0
"""Deadline that no search reaches, so that results do not depend on the machine [s]."""


def main() -> None:
    """Solves all tasks with references, and compares the energies."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, help="tasks (all with references)")
    given = arguments.parse_args()
    on_one_core()
    robot = load_robot("ur5e")
    compile_kernel(robot)
    reference = load()
    if reference["fingerprint"] != fingerprint(robot):
        raise SystemExit(
            "The robot's parameters have changed: renew the references with python -m "
            "benchmarks.reference"
        )
    rows: list[dict[str, Any]] = []
    for row in reference["tasks"][: given.count]:
        if row["energy"] is None:  # no start led to a motion
            continue
        task = move(reference["seed"], row["index"])
        try:
            energy = optimize(
                replace(problem_of(task), deadline=UNREACHED_DEADLINE)
            ).energy.electrical.total
        except JoulepathError as error:
            print(f"index {task.index}: {error!r}")
            energy = float("inf")
        excess, fine_excess = energy / row["energy"] - 1, energy / row["fine"] - 1
        rows.append(
            {"index": task.index, "energy": energy, "excess": excess, "fine_excess": fine_excess}
        )
    worst = sorted(rows, key=lambda row: row["excess"], reverse=True)
    results = {
        "seed": reference["seed"],
        "count": len(rows),
        "starts": reference["starts"],
        "ipopt_starts": reference["ipopt_starts"],
        "control_points": reference["control_points"],
        "fine_control_points": reference["fine_control_points"],
        "excess": Spread.of([row["excess"] for row in rows]),
        "fine_excess": Spread.of([row["fine_excess"] for row in rows]),
        "within_one_percent": sum(row["excess"] <= 0.01 for row in rows) / len(rows),
        "worst": worst[:5],
    }
    print(
        f"energy above the best of {results['starts']} starts: "
        f"{results['excess'].times(100).formatted(' %', 2)}"
    )
    print(
        "above the references refined on a finer grid: "
        f"{results['fine_excess'].times(100).formatted(' %', 2)}"
    )
    print(f"within one percent: {results['within_one_percent']:.0%}")
    print(f"worst: {[(row['index'], round(row['excess'], 4)) for row in worst[:5]]}")
    write_json(given.json, results)


if __name__ == "__main__":
    main()
