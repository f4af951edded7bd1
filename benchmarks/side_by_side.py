"""Times of planners that alternate on the same seeded tasks.

    python -m benchmarks.side_by_side answer drake --count 20 --repeat 3

Every planner runs in its own process on one core. For every task, the first planner runs before
and after every other planner, and this is repeated `--repeat` times. The result of a planner for a
task is the median of its times. Changes of the machine's speed hardly affect the ratios of these
medians.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence

import numpy as np

from benchmarks.command import THREADS, parser, write_json
from benchmarks.planners.__main__ import PLANNERS, attempt, planner_of
from benchmarks.service import ROOT
from benchmarks.statistics import Spread
from benchmarks.tasks import moves
from joulepath.models.robot import Array

WALL = "wall "
"""Prefix of the lines with times, because planners may print other lines."""


class Worker:
    """A planner in another process, which plans the seeded tasks by their indices."""

    def __init__(self, name: str, seed: int, count: int) -> None:
        call = f"from benchmarks.side_by_side import serve; serve({name!r}, {seed}, {count})"
        self._process = subprocess.Popen(
            [sys.executable, "-c", call],
            cwd=ROOT,
            env=os.environ | dict.fromkeys(THREADS, "1"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._reported_wall()

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def wall(self, index: int) -> float:
        """Wall time [s] of a task. Raises RuntimeError if the process ends."""
        assert self._process.stdin is not None
        print(index, file=self._process.stdin, flush=True)
        return self._reported_wall()

    def _reported_wall(self) -> float:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(WALL):
                return float(line.removeprefix(WALL))
        raise RuntimeError(
            "a planner's process ended; `make bench` installs the packages that the planners need"
        )


def serve(name: str, seed: int, count: int) -> None:
    """Plans the tasks whose indices arrive on the standard input, and prints their wall times [s].

    The first time printed is for a first call, which builds the planner.
    """
    planner, tasks = planner_of(name), list(moves(seed, count))
    print(f"{WALL}{attempt(planner, tasks[0])[0]}", flush=True)
    for line in sys.stdin:
        print(f"{WALL}{attempt(planner, tasks[int(line)])[0]}", flush=True)


def measured(first: Worker, others: Sequence[Worker], count: int, repeat: int) -> Array:
    """Wall times (1 + others, count) [s] of all planners."""
    walls = np.empty((1 + len(others), count))
    for task in range(count):
        of_first, of_others = list[float](), [list[float]() for _ in others]
        for _ in range(repeat):
            for other, times in zip(others, of_others, strict=True):
                of_first.append(first.wall(task))
                times.append(other.wall(task))
                of_first.append(first.wall(task))
        walls[:, task] = [np.median(times) for times in (of_first, *of_others)]
    return walls


def main() -> None:
    """Runs all planners, and prints times and ratios."""
    arguments = parser(__doc__)
    arguments.add_argument("first", choices=PLANNERS)
    arguments.add_argument("others", choices=PLANNERS, nargs="+")
    arguments.add_argument("--count", type=int, default=20, help="tasks (%(default)s)")
    arguments.add_argument(
        "--repeat", type=int, default=1, help="repetitions of every task (%(default)s)"
    )
    given = arguments.parse_args()
    names, workers = [given.first, *given.others], list[Worker]()
    try:
        for name in names:
            workers.append(Worker(name, given.seed, given.count))
        walls = measured(workers[0], workers[1:], given.count, given.repeat)
    finally:
        for worker in workers:
            worker.end()
    for name, times in zip(names, walls, strict=True):
        print(f"{name:10s} {Spread.of(times.tolist()).times(1e3).formatted(' ms')}")
    ratios = {}
    for name, times in zip(given.others, walls[1:], strict=True):
        ratio = float(np.median(times) / np.median(walls[0]))
        spread = Spread.of((times / walls[0]).tolist())
        ratios[name] = ratio
        print(
            f"{name} / {given.first}: ratio of the medians {ratio:.1f}; ratio per task: "
            f"{spread.formatted()}"
        )
    write_json(
        given.json, {"seed": given.seed, "names": names, "walls": walls.tolist(), "ratios": ratios}
    )


if __name__ == "__main__":
    main()
