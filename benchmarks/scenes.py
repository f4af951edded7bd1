"""Random tasks among obstacles, solved and replayed.

    python -m benchmarks.scenes --count 300 --seed 0
    python -m benchmarks.scenes --count 60 --method time_scaling

The tasks alternate between tables, shelves, boxes and cages, and have collision-free paths. Every
task is solved twice: from joint positions to joint positions, as one candidate, and to a pose, as a
whole request. Pinocchio and Coal replay every answer with a period of 0.1 ms. The exit code is 1 if
a requirement fails.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.cells import CELLS, CellTask, cell_tasks
from benchmarks.collision_replay import collisions
from benchmarks.command import on_one_core, parser, verdict
from benchmarks.statistics import Spread
from joulepath import optimize
from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.solve.methods import METHODS
from joulepath.optimizer.solve.methods.solve_result import MotionOrigin

REPLAY_PERIOD = 1e-4
"""Period of the replay [s]."""
LEAST_SOLVED = 0.99
"""Smallest admissible fraction of solved tasks of each kind [1]."""
KINDS = ("one candidate", "whole request")
PLANNED = (MotionOrigin.FROM_PLANNED_PATH.value, MotionOrigin.ALONG_PLANNED_PATH.value)


@dataclass
class Outcome:
    """Result of one task for one kind of request."""

    task: CellTask
    kind: str
    wall: float = 0.0
    error: str | None = None
    from_planned_path: bool = False
    collisions: int = 0
    solves: int = 0
    proven: float = 0.0

    @property
    def name(self) -> str:
        """Seed, index, kind of cell and kind of request."""
        return f"{self.task.name}, {self.kind}"


def run(task: CellTask, kind: str, method: MethodName = "bspline") -> Outcome:
    """Solves and replays one task by a method."""
    arm = task.arm
    goal: Array | Pose = task.q_goal if kind == KINDS[0] else Pose(task.T_goal)
    problem = Problem(
        arm=Arm(
            robot=load_robot("ur5e"), scene=arm.scene, tool=arm.tool, T_flange_tcp=arm.T_flange_tcp
        ),
        start=task.q_start,
        goal=goal,
        windings=kind != KINDS[0],
        method=method,
    )
    outcome = Outcome(task, kind)
    began = time.perf_counter()
    try:
        solution = optimize(problem)
    except JoulepathError as error:
        outcome.wall = time.perf_counter() - began
        late = isinstance(error, DeadlineExceeded)
        outcome.error = "out of time" if late else type(error).__name__
        return outcome
    outcome.wall = time.perf_counter() - began
    outcome.solves = solution.solver.nlp_solves
    outcome.from_planned_path = any(
        candidate.reason.endswith(PLANNED)
        for candidate in solution.candidates
        if candidate.status == "solved"
    )
    found = solution.certificate.clearance
    outcome.proven = np.nan if found is None else found.min_clearance
    outcome.collisions = collisions(arm, solution.trajectory.spline, REPLAY_PERIOD)
    return outcome


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Statistics of a run."""
    by_kind = {kind: [o for o in outcomes if o.kind == kind] for kind in KINDS}
    solved = [o for o in outcomes if o.error is None]
    return {
        "count": len(outcomes) // len(KINDS),
        "blocked": sum(o.task.blocked for o in by_kind[KINDS[0]]),
        "draws": sum(o.task.draws for o in by_kind[KINDS[0]]),
        "obstacles": Spread.of([len(o.task.arm.scene.obstacles) for o in by_kind[KINDS[0]]]),
        "solved": {kind: sum(o.error is None for o in of) for kind, of in by_kind.items()},
        "from_planned_path": {
            kind: sum(o.from_planned_path for o in of) for kind, of in by_kind.items()
        },
        "wall": {kind: Spread.of([o.wall for o in of]) for kind, of in by_kind.items()},
        "solves": {
            kind: Spread.of([o.solves for o in of if o.error is None])
            for kind, of in by_kind.items()
        },
        "cells": {
            cell: {kind: _solved(of, cell) for kind, of in by_kind.items()} for cell in CELLS
        },
        "errors": dict(Counter(o.error for o in outcomes if o.error)),
        "unsolved": [f"{o.name}: {o.error}" for o in outcomes if o.error],
        "collisions": [
            f"{o.name}: in collision at {o.collisions} instants" for o in solved if o.collisions
        ],
        "least_proven": min((o.proven for o in solved), default=np.nan),
    }


def _solved(outcomes: Sequence[Outcome], cell: str) -> str:
    of = [o for o in outcomes if o.task.cell == cell]
    return (
        f"{sum(o.error is None for o in of)} of {len(of)}, median "
        f"{Spread.of([o.wall for o in of]).p50:.2f} s"
    )


def failed_requirements(results: dict[str, Any]) -> list[str]:
    """A message for every failed requirement of a run."""
    found = list(results["collisions"])
    for kind, number in results["solved"].items():
        if number < LEAST_SOLVED * results["count"]:
            found.append(
                f"{kind}: {number} of {results['count']} solved, required {LEAST_SOLVED:.0%} or "
                "more"
            )
    return found


def print_summary(results: dict[str, Any]) -> None:
    """Prints the statistics of a run."""
    print(
        f"tasks                       {results['count']} of {results['draws']} draws; straight "
        f"line in collision in {results['blocked']}"
    )
    print(f"obstacles                   {results['obstacles'].formatted('', 0)}")
    for kind in KINDS:
        print(f"{kind:14s} solved       {results['solved'][kind]}")
        print(f"{kind:14s} from planned paths {results['from_planned_path'][kind]}")
        print(f"{kind:14s} wall time    {results['wall'][kind].times(1e3).formatted(' ms', 0)}")
        print(f"{kind:14s} NLPs solved  {results['solves'][kind].formatted('', 0)}")
    for cell, solved in results["cells"].items():
        print(f"    {cell:6s} " + "; ".join(f"{kind} {text}" for kind, text in solved.items()))
    print(f"errors                      {results['errors'] or 'none'}")
    for line in results["unsolved"][:20]:
        print(f"    {line}")
    print(f"answers in collision        {len(results['collisions'])}")
    print(f"least proven clearance      {results['least_proven']:.1e} m")


def main() -> int:
    """Solves the tasks and checks the requirements."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=300, help="tasks (%(default)s)")
    arguments.add_argument(
        "--method", choices=METHODS, default="bspline", help="method (%(default)s)"
    )
    given = arguments.parse_args()
    on_one_core()
    outcomes = [
        run(task, kind, given.method)
        for task in cell_tasks(given.seed, given.count)
        for kind in KINDS
    ]
    results = summary(outcomes)
    print_summary(results)
    return verdict(given.json, results, failed_requirements(results))


if __name__ == "__main__":
    sys.exit(main())
