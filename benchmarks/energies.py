"""Least energies of seeded tasks with an ample deadline, for comparisons of two versions.

    python -m benchmarks.energies --count 200 --json build/energies.json
    python -m benchmarks.energies --count 200 --compare build/energies.json
    python -m benchmarks.energies --kind slow --count 200

The tasks alternate between five kinds: joint to joint, joint to pose, the mechanical objective, a
payload, and the cells of `benchmarks.cells`. The library solves all tasks. With `--compare`, the
exit code is 1 if the task, the outcome or the energy of an index differs from the stored run;
energies may differ by RELATIVE. With `--kind slow`, slow moves are solved instead, and compared
with their variants: see `benchmarks.slow_moves`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import orjson

from benchmarks.cells import cell_task
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.slow_moves import compare
from benchmarks.tasks import collision_free, flange
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.optimize import optimize, warm_up
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot

Kind = Literal["joint to joint", "joint to pose", "mechanical", "payload", "cell"]
KINDS: tuple[Kind, ...] = ("joint to joint", "joint to pose", "mechanical", "payload", "cell")
UNREACHED_DEADLINE = 600.0
"""Deadline that no search reaches, so that results do not depend on the machine [s]."""
RELATIVE = 1e-6
"""Relative difference of two equal energies [1]: rounding of reordered sums, amplified by the
convergence criterion of the solver."""
SAME_TASK = 1e-9
"""Rounding error of the numbers of a task: joint positions [rad] and entries of the goal pose."""
LONGEST_MECHANICAL = (3.0, 6.0)
"""Range of the longest duration of mechanical tasks [s]."""


def problem_of(seed: int, index: int) -> tuple[Kind, Problem]:
    """The kind of task `index` of a seed, and its problem."""
    kind, robot = KINDS[index % len(KINDS)], load_robot("ur5e")
    if kind == "cell":
        cell = cell_task(seed, index)
        return kind, Problem(
            arm=cell.arm, start=cell.q_start, goal=Pose(cell.T_goal), deadline=UNREACHED_DEADLINE
        )
    rng = np.random.default_rng([seed, index])
    q_start, q_goal = collision_free(rng, robot), collision_free(rng, robot)
    goal: Array | Pose = q_goal if kind == "joint to joint" else Pose(flange(robot, q_goal))
    if kind == "mechanical":
        longest = float(rng.uniform(*LONGEST_MECHANICAL))
        # The lower bound of the mechanical objective excludes few candidates: eight remain without
        # full turns, and with full turns the search takes minutes.
        return kind, Problem(
            arm=Arm(robot=robot),
            start=q_start,
            goal=goal,
            objective="mechanical",
            duration_max=longest,
            windings=False,
            deadline=UNREACHED_DEADLINE,
        )
    payload = Payload()
    if kind == "payload":
        mass = float(rng.uniform(0.5, robot.rated_payload))
        payload = Payload(mass=mass, com=rng.uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.15]))
    return kind, Problem(
        arm=Arm(robot=robot, payload=payload), start=q_start, goal=goal, deadline=UNREACHED_DEADLINE
    )


def solve(seed: int, index: int) -> dict[str, Any]:
    """The outcome of one task: energy of the objective [J] and duration [s], or the name of the
    error.
    """
    kind, problem = problem_of(seed, index)
    goal = problem.goal.T.ravel() if isinstance(problem.goal, Pose) else problem.goal
    row: dict[str, Any] = {
        "index": index,
        "kind": kind,
        "task": [*np.asarray(problem.start).tolist(), *np.asarray(goal).tolist()],
        "outcome": "",
        "energy": None,
        "duration": None,
    }
    began = time.perf_counter()
    try:
        solution = optimize(problem)
    except JoulepathError as error:
        return row | {"outcome": type(error).__name__, "wall": time.perf_counter() - began}
    energy = solution.energy
    total = (
        energy.electrical.total if problem.objective == "electrical" else energy.mechanical.total
    )
    return row | {
        "outcome": solution.status,
        "energy": total,
        "duration": solution.duration,
        "wall": time.perf_counter() - began,
    }


def relative_difference(row: dict[str, Any], other: dict[str, Any]) -> float:
    """|difference| of two energies over the second one; 0 without energies, inf if one is
    missing."""
    ours, theirs = row["energy"], other["energy"]
    if ours is None or theirs is None:
        return 0.0 if ours is theirs else float("inf")
    return float(abs(ours - theirs) / max(abs(theirs), 1e-12))


def differences(rows: Sequence[dict[str, Any]], stored: Sequence[dict[str, Any]]) -> list[str]:
    """One message per index with a different task, outcome or energy, or without a stored row."""
    by_index = {row["index"]: row for row in stored}
    messages = []
    for row in rows:
        name, other = f"index {row['index']} ({row['kind']})", by_index.get(row["index"])
        if other is None:
            messages.append(f"{name}: not in the stored run")
        elif row["kind"] != other["kind"] or not same_task(row["task"], other["task"]):
            messages.append(f"{name}: the task itself differs")
        elif row["outcome"] != other["outcome"]:
            messages.append(f"{name}: {row['outcome']}, stored {other['outcome']}")
        # this comparison is written so that NaN is a difference
        elif not relative_difference(row, other) <= RELATIVE:
            messages.append(
                f"{name}: {row['energy']:.9g} J, stored {other['energy']:.9g} J: "
                f"{relative_difference(row, other):.2g} relative"
            )
    return messages


def same_task(task: Sequence[float], other: Sequence[float]) -> bool:
    """Whether two tasks have the same start and goal up to rounding."""
    return len(task) == len(other) and bool(np.allclose(task, other, rtol=0.0, atol=SAME_TASK))


def main() -> int:
    """Solve the tasks, print their energies, and compare."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=200, help="tasks (%(default)s)")
    arguments.add_argument("--compare", type=Path, help="a stored run to compare with")
    arguments.add_argument(
        "--kind", choices=("ordinary", "slow"), default="ordinary", help="moves (%(default)s)"
    )
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    warm_up("ur5e")
    if given.kind == "slow":
        return compare(given.seed, given.count, given.json)
    rows = []
    for index in range(given.count):
        rows.append(row := solve(given.seed, index))
        found = (
            row["outcome"] if row["energy"] is None else f"{row['energy']:.6f} J, {row['outcome']}"
        )
        print(f"{index:4d} {row['kind']:14s} {found}, {row['wall']:.2f} s", flush=True)
    write_json(given.json, {"seed": given.seed, "tasks": rows})
    if given.compare is None:
        return 0
    stored = orjson.loads(given.compare.read_bytes())
    if stored["seed"] != given.seed:
        raise SystemExit(
            f"{given.compare} holds seed {stored['seed']}: give --seed {stored['seed']}"
        )
    by_index = {row["index"]: row for row in stored["tasks"]}
    known = [
        relative_difference(row, by_index[row["index"]]) for row in rows if row["index"] in by_index
    ]
    print(f"largest relative difference {max(known, default=0.0):.2g} over {len(known)} tasks")
    messages = differences(rows, stored["tasks"])
    for message in messages:
        print(f"DIFFERENT: {message}")
    return 1 if messages else 0


if __name__ == "__main__":
    sys.exit(main())
