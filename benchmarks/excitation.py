"""Excitation of arms against its gates. The exit code is 1 if one is missed.

    python -m benchmarks.excitation
    python -m benchmarks.excitation --robots ur5e panda --starts 3

Each robot alone on its mounting plane, period 10 s, 5 harmonics, 54 % of the speed limits, by both criteria. The gates
are for one start of the ur5e with the criterion `d`: column-scaled condition ≤ 60, proven clearance ≥ 20 mm, ≤ 60 s on
one core.
"""

from __future__ import annotations

import sys
import time
from typing import Any, get_args

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from joulepath.models.registry import load_robot
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.excitation.excitation_problem import Criterion, ExcitationProblem
from joulepath.optimizer.excitation.excite import excite
from joulepath.optimizer.problem.arm import Arm

MOST_CONDITION, LEAST_CLEARANCE, MOST_TIME = 60.0, 0.02, 60.0
SPEED = 0.54


def measured(name: str, criterion: Criterion, starts: int) -> dict[str, Any]:
    """Condition, clearance and time of one robot by one criterion."""
    robot = load_robot(name)
    compile_kernel(robot)
    began = time.process_time()
    problem = ExcitationProblem(
        arm=Arm(robot=robot), speed_fraction=SPEED, criterion=criterion, starts=starts, deadline=np.inf
    )
    found = excite(problem)
    seconds = time.process_time() - began
    clearance = found.certificate.clearance
    return {
        "robot": name,
        "criterion": criterion,
        "scaled_condition": found.scaled_condition,
        "condition": found.condition,
        "clearance": None if clearance is None else clearance.min_clearance,
        "period": found.period,
        "seconds_per_start": seconds / starts,
        "feasible": found.feasible,
    }


def main() -> None:
    """Prints a row for each robot."""
    options = parser(__doc__)
    options.add_argument("--robots", nargs="+", default=["ur5e"], help="robots (%(default)s)")
    options.add_argument("--starts", type=int, default=1, help="starts of each (%(default)s)")
    given = options.parse_args()
    on_one_core()
    rows = [measured(name, kind, given.starts) for name in given.robots for kind in get_args(Criterion)]
    columns = ("robot", "criterion", "column-scaled condition", "condition", "clearance [mm]", "period [s]", "CPU [s]")
    print("|", " | ".join(columns), "|")
    print("| --- " * len(columns) + "|")
    for row in rows:
        cells = (f"{row['scaled_condition']:.1f}", f"{row['condition']:.0f}", f"{row['clearance'] * 1e3:.0f}")
        times = (f"{row['period']:.2f}", f"{row['seconds_per_start']:.0f}")
        print("|", " | ".join([row["robot"], row["criterion"], *cells, *times]), "|")
    write_json(given.json, {"rows": rows})
    kept = all(
        row["scaled_condition"] <= MOST_CONDITION
        and row["clearance"] >= LEAST_CLEARANCE
        and row["seconds_per_start"] <= MOST_TIME
        for row in rows
        if (row["robot"], row["criterion"]) == ("ur5e", "d")
    )
    sys.exit(0 if kept else 1)


if __name__ == "__main__":
    main()
