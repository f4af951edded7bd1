"""Comparison of the methods on random motions: energies relative to `bspline`, and processor times.

`python -m benchmarks.methods --count 20 --seed 0`
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from joulepath.models.registry import load_robot
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.methods import METHODS
from joulepath.optimizer.optimize import optimize, warm_up
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import MethodName, Problem

# joints are within half a turn of zero, as in the paper's poses [rad]
RANGE = np.pi
DEADLINE = 60.0


def measure(count: int, seed: int) -> dict[MethodName, list[tuple[float, float]]]:
    """(energy [J], processor time [s]) of every method on `count` random motions; NaN without a motion."""
    robot = load_robot("ur5e")
    compile_kernel(robot)
    warm_up(robot.name)
    rng = np.random.default_rng(seed)
    table: dict[MethodName, list[tuple[float, float]]] = {method: [] for method in METHODS}
    for start, goal in rng.uniform(-RANGE, RANGE, (count, 2, robot.nq)):
        for method, rows in table.items():
            began = time.process_time()
            try:
                energy = optimize(
                    Problem(
                        arm=Arm(robot=load_robot("ur5e"), collisions=False),
                        start=start,
                        goal=goal,
                        method=method,
                        deadline=DEADLINE,
                    )
                ).energy.electrical.total
            except JoulepathError:
                energy = np.nan
            rows.append((energy, time.process_time() - began))
    return table


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    table = measure(given.count, given.seed)
    best = np.array([energy for energy, _ in table["bspline"]])
    print(
        "| method | solved | energy above `bspline`: median [%] | maximum [%] "
        "| processor time: median [s] | maximum [s] |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for method, rows in table.items():
        energy, took = np.array(rows).T
        over = energy / best - 1
        print(
            f"| `{method}` | {int(np.isfinite(energy).sum())} of {given.count} | {100 * np.nanmedian(over):+.2f} | "
            f"{100 * np.nanmax(over):+.2f} | {np.median(took):.3f} | {took.max():.3f} |"
        )


if __name__ == "__main__":
    main()
