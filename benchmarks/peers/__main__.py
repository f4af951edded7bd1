"""One peer over the seeded joint-to-joint tasks, in a process of its own, replayed on the fine grid.

python -m benchmarks.peers drake --count 20
"""

from __future__ import annotations

import time
from importlib import import_module
from typing import Any

from benchmarks.command import keep, on_one_core, parser
from benchmarks.figures import Spread
from benchmarks.motion import Replay, replay
from benchmarks.peers.peer import Peer, versions
from benchmarks.tasks import Move, moves
from models.registry import load_robot
from optimizer.problem.arm import Arm
from optimizer.problem.problem import Problem

PEERS = {
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
REACHED = 1e-6  # how far off its ends a motion may be [rad]


def attempt(peer: Peer, task: Move) -> tuple[float, Replay | None]:
    """Wall time [s] and what came of a task; an exception of the peer counts as no motion."""
    began = time.perf_counter()
    try:
        motion = peer.plan(task.q_start, task.q_goal)
    except Exception as error:  # a stranger's failure must not end the comparison
        print(f"index {task.index}: {error!r}")
        motion = None
    wall = time.perf_counter() - began
    if motion is None:
        return wall, None
    found = replay(
        Problem(arm=Arm(robot=load_robot("ur5e"), collisions=False), start=task.q_start, goal=task.q_goal),
        motion,
        task.q_start,
        task.q_goal,
    )
    return wall, found if found.end_error <= REACHED else None


def main() -> None:
    """Run one peer."""
    arguments = parser(__doc__)
    arguments.add_argument("peer", choices=PEERS)
    arguments.add_argument("--count", type=int, default=20, help="tasks (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    robot = load_robot("ur5e")
    module, name = PEERS[given.peer].split(":")
    began = time.perf_counter()
    peer: Peer = getattr(import_module(f"benchmarks.peers.{module}"), name)(robot)
    tasks = list(moves(given.seed, given.count))
    attempt(peer, tasks[0])  # what is done once, at the first call
    built = time.perf_counter() - began
    rows: list[dict[str, Any]] = []
    for task in tasks:
        wall, found = attempt(peer, task)
        rows.append({"index": task.index, "wall": wall})
        if found is not None:
            rows[-1] |= {
                "energy": found.energy.electrical.total,
                "duration": found.duration,
                "shares": found.ratios,
                "worst": found.worst,
            }
    solved = [row for row in rows if "energy" in row]
    print(f"{peer.title} ({versions(peer)}): {peer.what}")
    print(
        f"solved {len(solved)} of {len(rows)}, wall {Spread.of([row['wall'] for row in rows]).times(1e3).told(' ms')}"
    )
    print(f"energy {Spread.of([row['energy'] for row in solved]).told(' J')}")
    print(f"worst share of a limit {max((row['worst'] for row in solved), default=0.0):.4f}")
    keep(
        given.json,
        {
            "title": peer.title,
            "versions": versions(peer),
            "what": peer.what,
            "seed": given.seed,
            "built": built,
            "rows": rows,
        },
    )


if __name__ == "__main__":
    main()
