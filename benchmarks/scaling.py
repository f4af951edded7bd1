"""Growth of the solve time with control points, degrees of freedom and candidates, and of checks with points.

`--only points` measures the checks alone, in a minute: a scanned room of 100 to 100,000 points around the arm.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.chains import chain
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.statistics import Spread, exponent
from benchmarks.tasks import move, moves, request_task
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.clearance_proof import proven_clearance
from joulepath.optimizer.collision.clouds import cloud_of
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.state_validity import StateValidityChecker
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.methods.free_spline import FreeSpline
from joulepath.optimizer.methods.sqp_method import Guess
from joulepath.optimizer.nlp.clearance_constraint import COUNTED
from joulepath.optimizer.optimize import optimize, warm_up
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter, Label
from joulepath.optimizer.problem.clouds import Points
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.scene import Obstacle, Scene
from joulepath.optimizer.trajectories import bspline
from joulepath.optimizer.trajectories.time_scalings import quintic_spline

CONTROL_POINTS = (8, 10, 13, 16, 20, 24, 28, 32)
JOINTS = (2, 3, 4, 5, 6, 7)
POINTS = (100, 1_000, 10_000, 100_000)
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


def by_points(seed: int, count: int) -> list[dict[str, Any]]:
    """Times per state [s] of checks against point clouds: of the planner, of exact distances, and of a proof.

    The points lie on a floor, two walls and things of random size. `wall` is the time of the planner's check; the
    iterations are the points. `distances` is that of exact distances of a batch of states, up to COUNTED; `proof` is
    that of the clearance proof of one motion, `build` that of the tree.
    """
    robot, rows = load_robot("ur5e"), []
    rng = np.random.default_rng(seed)
    for size in POINTS:
        points = _room(rng, size)
        began = time.perf_counter()
        cloud_of(Points(points, 0.01))
        build = time.perf_counter() - began
        arm = Arm(robot=robot, scene=Scene([Obstacle("room", Points(points, 0.01))]))
        model = CollisionModel(arm)
        checker = StateValidityChecker(arm, model)
        states = rng.uniform(-np.pi, np.pi, (count * 8, robot.nq))
        # alone, the arm would collide with itself in many states, and no point would be looked at
        states = states[[CollisionModel(Arm(robot=robot)).least_distance(q[None], 0.0) > 0 for q in states]]
        walls, distances, proofs = [], [], []
        for q in states:
            began = time.perf_counter()
            checker.is_valid(q)
            walls.append(time.perf_counter() - began)
        for _ in range(count):
            began = time.perf_counter()
            model.pair_distances(model.frames(states), within=COUNTED)
            distances.append((time.perf_counter() - began) / len(states))
        for first, second in pairwise(states[: count + 1]):
            began = time.perf_counter()
            proven_clearance(model, quintic_spline(first, second, 2.0))
            proofs.append(time.perf_counter() - began)
        extra = {"distances": Spread.of(distances), "proof": Spread.of(proofs), "build": build}
        rows.append(_row(size, walls, [size]) | extra)
    return rows


def _room(rng: np.random.Generator, size: int) -> Array:
    """Points (size, 3) [m] on a floor, two walls, and four spheres that stand in reach of the arm."""
    share = size // 8
    floor = np.column_stack([rng.uniform(-1.2, 1.2, (size - 7 * share, 2)), np.full(size - 7 * share, -0.1)])
    upright = rng.uniform([-1.2, -0.1], [1.2, 1.5], (2, share, 2))
    walls = [np.insert(points, axis, 0.8, axis=1) for axis, points in enumerate(upright)]
    things = []
    for angle in (0.5, 2.0, 3.5, 5.0):
        around = rng.normal(size=(share, 3))
        around *= rng.uniform(0.05, 0.2) / np.linalg.norm(around, axis=1)[:, None]
        things.append(around + np.array([0.6 * np.cos(angle), 0.6 * np.sin(angle), rng.uniform(0.0, 0.4)]))
    return np.concatenate([floor, *walls, *things, rng.uniform([-1.2, -1.2, 1.4], [1.2, 1.2, 1.5], (share, 3))])


def _branch(robot: Robot, T_goal: Array) -> BranchFilter:
    label = required_inverse_kinematics(robot, "goal").branches(T_goal)[0].label
    assert isinstance(label, Label)
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


MEASURES: dict[str, Callable[[int, int], list[dict[str, Any]]]] = {
    "control_points": by_control_points,
    "joints": by_joints,
    "candidates": by_candidates,
    "points": by_points,
}


def main() -> None:
    """Measures all four, or one of them."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=25, help="tasks per size (%(default)s)")
    arguments.add_argument("--only", choices=MEASURES, help="one measure instead of all")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    warm_up("ur5e")
    results: dict[str, Any] = {"count": given.count}
    for name in MEASURES if given.only is None else (given.only,):
        rows = MEASURES[name](given.seed, given.count)
        results[name] = {"rows": rows, "exponent": growth(rows), "exponent_per_iteration": per_iteration(rows)}
        print(f"{name}: time ∝ size^{growth(rows):.2f}, time of an iteration ∝ size^{per_iteration(rows):.2f}")
        for row in rows:
            print(
                f"    {row['size']:6.0f} {row.get('name', '')} {row['wall'].times(1e3).formatted(' ms')}, "
                f"iterations {row['iterations'].p50:.0f}, {row.get('solved', '')}"
            )
            if name == "points":
                print(
                    f"           exact distances {row['distances'].p50 * 1e3:.3f} ms per state, clearance proof "
                    f"{row['proof'].p50 * 1e3:.0f} ms per motion, tree built in {row['build'] * 1e3:.0f} ms"
                )
    write_json(given.json, results)


if __name__ == "__main__":
    main()
