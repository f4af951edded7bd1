"""Growth of the solve time with control points, degrees of freedom and candidates."""

from __future__ import annotations

import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from benchmarks.chains import chain
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread, exponent
from benchmarks.tasks import move, moves, request_task
from models.registry import load_robot
from models.robot import Array, Robot
from optimizer.deadline import Deadline
from optimizer.energy.kernel_cache import compile_kernel
from optimizer.exceptions import JoulepathError
from optimizer.kinematics.inverse import required_inverse_kinematics
from optimizer.methods.free_spline import FreeSpline
from optimizer.methods.sqp_method import Guess
from optimizer.optimize import optimize, warm_up
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.arm import Arm
from optimizer.problem.branches import BranchFilter
from optimizer.problem.pose import Pose
from optimizer.problem.problem import Problem
from optimizer.trajectories import bspline

CONTROL_POINTS = (8, 10, 13, 16, 20, 24, 28, 32)
JOINTS = (2, 3, 4, 5, 6, 7)
PATIENCE = 60.0  # longest time of one solve [s]


def by_control_points(seed: int, count: int) -> list[dict[str, Any]]:
    """Times of one NLP over evenly spaced knots from the straight line, including repairs between the nodes."""
    rows = []
    for n in CONTROL_POINTS:
        space = bspline.uniform(n)
        walls, iterations, solved = [], [], 0
        # the first task runs twice: what is built once per spline space is not part of a solve
        for task in (move(seed, 0), *moves(seed, count)):
            points = task.q_start + np.outer(space.quintic, task.q_goal - task.q_start)
            began = time.perf_counter()
            solver = FreeSpline(
                PreparedProblem.of(
                    Problem(arm=Arm(robot=load_robot("ur5e"), collisions=False), start=task.q_start, goal=task.q_goal)
                ),
                task.q_start,
                task.q_goal,
                Deadline.after(PATIENCE),
            )
            outcome = solver.improve(Guess(space, points, 0.0))
            walls.append(time.perf_counter() - began)
            iterations.append(outcome.iterations)
            solved += outcome.spline is not None
        rows.append(_row(n, walls[1:], iterations[1:]) | {"nodes": len(space.nodes), "solved": solved - 1})
    return rows


def by_joints(seed: int, count: int) -> list[dict[str, Any]]:
    """Times of one candidate of an arm whose chain is shortened or extended."""
    robots = [chain(load_robot("ur5e"), joints) for joints in JOINTS]
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(compile_kernel, robots))
    rows = []
    for robot in robots:
        walls, iterations, solved = [], [], 0
        for task in (move(seed, 0, robot), *moves(seed, count, robot)):
            began = time.perf_counter()
            problem = Problem(arm=Arm(robot=robot, collisions=False), start=task.q_start, goal=task.q_goal)
            outcome = FreeSpline(
                PreparedProblem.of(problem), task.q_start, task.q_goal, Deadline.after(PATIENCE)
            ).solve()
            walls.append(time.perf_counter() - began)
            iterations.append(outcome.iterations)
            solved += outcome.spline is not None
        rows.append(_row(robot.nq, walls[1:], iterations[1:]) | {"solved": solved - 1})
    return rows


def by_candidates(seed: int, count: int) -> list[dict[str, Any]]:
    """Times of a whole answer by the library, for one or all branches, with and without full-turn alternatives."""
    robot = load_robot("ur5e")
    allowed = {
        "one branch": (True, False),
        "one branch, full turns": (True, True),
        "all branches": (False, False),
        "all branches, full turns": (False, True),
    }
    rows = []
    for name, (one_branch, windings) in allowed.items():
        walls, candidates, solves = [], [], []
        for index in range(count):
            task = request_task(seed, index, "joint to pose")
            q_start, goal = np.array(task.body["start"]["q"]), Pose(_orthonormal(task.T_goal))
            branch = _branch(robot, task.T_goal) if one_branch else None
            began = time.perf_counter()
            try:
                solution = optimize(
                    Problem(
                        arm=Arm(robot=robot, collisions=False),
                        start=q_start,
                        goal=goal,
                        branch=branch,
                        windings=windings,
                    )
                )
            except JoulepathError:
                continue
            walls.append(time.perf_counter() - began)
            candidates.append(len(solution.candidates))
            solves.append(solution.solver.nlp_solves)
        rows.append(_row(float(np.median(candidates)), walls, solves) | {"name": name})
    return sorted(rows, key=lambda row: row["size"])


def _branch(robot: Robot, T_goal: Array) -> BranchFilter:
    label = required_inverse_kinematics(robot, "goal").branches(T_goal)[0].label
    return BranchFilter(label.shoulder, label.elbow, label.wrist)


def _orthonormal(T: Array) -> Array:
    u, _, vt = np.linalg.svd(T[:3, :3])
    result = T.copy()
    result[:3, :3] = u @ vt
    return result


def _row(size: float, walls: list[float], iterations: Iterable[float]) -> dict[str, Any]:
    return {"size": size, "wall": Spread.of(walls), "iterations": Spread.of(list(iterations))}


def growth(rows: list[dict[str, Any]]) -> float:
    """Exponent of the median time as a function of the size."""
    return exponent([row["size"] for row in rows], [row["wall"].p50 for row in rows])


def per_iteration(rows: list[dict[str, Any]]) -> float:
    """Exponent of the median time of an iteration as a function of the size."""
    each = [row["wall"].p50 / max(row["iterations"].p50, 1.0) for row in rows]
    return exponent([row["size"] for row in rows], each)


def main() -> None:
    """Measures all three."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=25, help="tasks per size (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    warm_up("ur5e")
    results: dict[str, Any] = {"count": given.count}
    for name, measure in (("control_points", by_control_points), ("joints", by_joints), ("candidates", by_candidates)):
        rows = measure(given.seed, given.count)
        results[name] = {"rows": rows, "exponent": growth(rows), "exponent_per_iteration": per_iteration(rows)}
        print(f"{name}: time ∝ size^{growth(rows):.2f}, time of an iteration ∝ size^{per_iteration(rows):.2f}")
        for row in rows:
            print(
                f"    {row['size']:6.0f} {row.get('name', '')} {row['wall'].times(1e3).formatted(' ms')}, "
                f"iterations {row['iterations'].p50:.0f}, {row.get('solved', '')}"
            )
    write_json(given.json, results)


if __name__ == "__main__":
    main()
