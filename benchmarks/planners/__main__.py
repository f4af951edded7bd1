"""One planner on the seeded joint-to-joint tasks, with replays of its motions on the fine grid.

python -m benchmarks.planners drake --count 20
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.motion import Replay, replay
from benchmarks.planners.planner import Planner, versions
from benchmarks.statistics import Spread
from benchmarks.tasks import Move, moves
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot

PLANNERS = {
    "answer": "joulepath:Answer",
    "candidate": "joulepath:Candidate",
    "line": "joulepath:Line",
    "drake": "drake_trajectory:DrakeTrajectory",
    "opti": "casadi_opti:CasadiOpti",
    "opti-grid": "casadi_opti:CasadiOptiGrid",
    "copp": "copp_line:CoppLine",
    "toppra": "toppra_fastest:ToppraFastest",
    "ruckig": "ruckig_fastest:RuckigFastest",
}
REACHED = 1e-6
"""Largest joint error at start and goal [rad]."""


def planner_of(name: str) -> Planner:
    """The planner with a name, for a UR5e. Raises ImportError if its packages are missing."""
    module, kind = PLANNERS[name].split(":")
    planner: Planner = getattr(import_module(f"benchmarks.planners.{module}"), kind)(
        load_robot("ur5e")
    )
    return planner


def attempt(planner: Planner, task: Move) -> tuple[float, Replay | None]:
    """Wall time [s] and the replayed motion of a task; None without a motion or after an exception
    of the planner.
    """
    began = time.perf_counter()
    try:
        motion = planner.plan(task.q_start, task.q_goal)
    except Exception as error:  # a failure of one planner must not end the comparison
        print(f"index {task.index}: {error!r}")
        motion = None
    wall = time.perf_counter() - began
    if motion is None:
        return wall, None
    found = replay(
        Problem(
            arm=Arm(robot=load_robot("ur5e"), collisions=False),
            start=task.q_start,
            goal=task.q_goal,
        ),
        motion,
        task.q_start,
        task.q_goal,
    )
    return wall, found if found.end_error <= REACHED else None


def main() -> None:
    """Runs one planner on all tasks."""
    arguments = parser(__doc__)
    arguments.add_argument("planner", choices=PLANNERS)
    arguments.add_argument("--count", type=int, default=20, help="tasks (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    began = time.perf_counter()
    planner = planner_of(given.planner)
    tasks = list(moves(given.seed, given.count))
    attempt(planner, tasks[0])  # the first call builds objects for all later calls
    built = time.perf_counter() - began
    rows: list[dict[str, Any]] = []
    for task in tasks:
        wall, found = attempt(planner, task)
        rows.append({"index": task.index, "wall": wall})
        if found is not None:
            rows[-1] |= {
                "energy": found.energy.electrical.total,
                "duration": found.duration,
                "ratios": found.ratios,
                "worst": found.worst,
            }
    solved = [row for row in rows if "energy" in row]
    print(f"{planner.title} ({versions(planner)}): {planner.what}")
    times = Spread.of([row["wall"] for row in rows]).times(1e3)
    print(f"solved {len(solved)} of {len(rows)}, wall {times.formatted(' ms')}")
    print(f"energy {Spread.of([row['energy'] for row in solved]).formatted(' J')}")
    print(f"largest value / limit {max((row['worst'] for row in solved), default=0.0):.4f}")
    write_json(
        given.json,
        {
            "title": planner.title,
            "versions": versions(planner),
            "what": planner.what,
            "seed": given.seed,
            "built": built,
            "rows": rows,
        },
    )


if __name__ == "__main__":
    main()
