"""Random tasks among obstacles, solved and replayed: exits with 1 when an answer hits something or too few are solved.

    python -m benchmarks.scenes --count 300 --seed 0

Tables, shelves, boxes and cages in turn, every task known to have a way. Each is solved twice: joint to joint, which is
one candidate, and joint to pose, a whole request. Every answer is replayed by Pinocchio and Coal every 0.1 ms.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.cells import CELLS, CellTask, cell_tasks
from benchmarks.command import keep, on_one_core, parser
from benchmarks.figures import Spread
from models.registry import load_robot
from models.robot import Array
from optimizer import optimize
from optimizer.collision.model import CollisionModel
from optimizer.collision.state_validity import StateValidityChecker
from optimizer.exceptions import DeadlineExceeded, JoulepathError
from optimizer.methods.free_spline import FROM_PLANNED_PATH
from optimizer.problem.arm import Arm
from optimizer.problem.pose import Pose
from optimizer.problem.problem import Problem
from optimizer.trajectories.spline import sample

REPLAY = 1e-4  # s
SOLVED = 0.99  # share that must be solved, of either kind
KINDS = ("one candidate", "whole request")


@dataclass
class Outcome:
    """What came of one task by one kind of request."""

    task: CellTask
    kind: str
    wall: float = 0.0
    refusal: str | None = None
    led: bool = False
    hits: int = 0
    solves: int = 0
    proven: float = 0.0
    tried: dict[str, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Where to find it again."""
        return f"{self.task.name}, {self.kind}"


def run(task: CellTask, kind: str) -> Outcome:
    """Solve and replay."""
    arm = task.arm
    goal: Array | Pose = task.q_goal if kind == KINDS[0] else Pose(task.T_goal)
    problem = Problem(
        arm=Arm(robot=load_robot("ur5e"), scene=arm.scene, tool=arm.tool, T_flange_tcp=arm.T_flange_tcp),
        start=task.q_start,
        goal=goal,
        windings=kind != KINDS[0],
    )
    outcome = Outcome(task, kind)
    began = time.perf_counter()
    try:
        solution = optimize(problem)
    except JoulepathError as error:
        outcome.wall = time.perf_counter() - began
        late = isinstance(error, DeadlineExceeded)
        outcome.refusal = "out of time" if late else type(error).__name__
        return outcome
    outcome.wall = time.perf_counter() - began
    outcome.solves = solution.solver.nlp_solves
    outcome.led = any(FROM_PLANNED_PATH in c.reason for c in solution.candidates if c.status == "solved")
    outcome.tried = dict(Counter(c.status for c in solution.candidates))
    found = solution.certificate.clearance
    outcome.proven = np.nan if found is None else found.min_clearance
    checker = StateValidityChecker(arm, CollisionModel(arm))
    t = np.append(np.arange(0.0, solution.duration, REPLAY), solution.duration)
    outcome.hits = sum(not checker.is_valid(q) for q in sample(solution.trajectory.spline, t)[0])
    return outcome


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of a run."""
    by_kind = {kind: [o for o in outcomes if o.kind == kind] for kind in KINDS}
    solved = [o for o in outcomes if o.refusal is None]
    return {
        "count": len(outcomes) // len(KINDS),
        "blocked": sum(o.task.blocked for o in by_kind[KINDS[0]]),
        "draws": sum(o.task.draws for o in by_kind[KINDS[0]]),
        "obstacles": Spread.of([len(o.task.arm.scene.obstacles) for o in by_kind[KINDS[0]]]),
        "solved": {kind: sum(o.refusal is None for o in of) for kind, of in by_kind.items()},
        "led": {kind: sum(o.led for o in of) for kind, of in by_kind.items()},
        "wall": {kind: Spread.of([o.wall for o in of]) for kind, of in by_kind.items()},
        "solves": {kind: Spread.of([o.solves for o in of if o.refusal is None]) for kind, of in by_kind.items()},
        "cells": {cell: {kind: _share(of, cell) for kind, of in by_kind.items()} for cell in CELLS},
        "refusals": dict(Counter(o.refusal for o in outcomes if o.refusal)),
        "refused": [f"{o.name}: {o.refusal}" for o in outcomes if o.refusal],
        "hits": [f"{o.name}: {o.hits} of its instants hit something" for o in solved if o.hits],
        "least proven": min((o.proven for o in solved), default=np.nan),
    }


def _share(outcomes: Sequence[Outcome], cell: str) -> str:
    of = [o for o in outcomes if o.task.cell == cell]
    return f"{sum(o.refusal is None for o in of)} of {len(of)}, p50 {Spread.of([o.wall for o in of]).p50:.2f} s"


def misses(figures: dict[str, Any]) -> list[str]:
    """Acceptance lines that a run misses."""
    found = list(figures["hits"])
    for kind, number in figures["solved"].items():
        if number < SOLVED * figures["count"]:
            found.append(f"{kind}: only {number} of {figures['count']} solved, at least {SOLVED:.0%} must be")
    return found


def tell(figures: dict[str, Any]) -> None:
    """Print a run's figures."""
    print(
        f"tasks                       {figures['count']}, of {figures['draws']} drawn; the straight line is blocked in "
        f"{figures['blocked']}; obstacles p50 {figures['obstacles'].p50:.0f}, most {figures['obstacles'].most:.0f}"
    )
    for kind in KINDS:
        print(f"{kind:14s} solved       {figures['solved'][kind]}, {figures['led'][kind]} of them led around")
        print(f"{kind:14s} wall time    {figures['wall'][kind].times(1e3).told(' ms', 0)}")
        print(f"{kind:14s} programmes   {figures['solves'][kind].told('', 0)}")
    for cell, shares in figures["cells"].items():
        print(f"    {cell:6s} " + "; ".join(f"{kind} {told}" for kind, told in shares.items()))
    print(f"refusals                    {figures['refusals'] or 'none'}")
    for line in figures["refused"][:20]:
        print(f"    {line}")
    print(f"answers that hit something  {len(figures['hits'])}; least clearance proven {figures['least proven']:.1e} m")


def main() -> int:
    """Run and judge."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=300, help="tasks (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    outcomes = [run(task, kind) for task in cell_tasks(given.seed, given.count) for kind in KINDS]
    figures = summary(outcomes)
    tell(figures)
    keep(given.json, figures)
    missed = misses(figures)
    for line in missed:
        print(f"MISSED: {line}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
