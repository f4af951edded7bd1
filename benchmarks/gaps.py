"""Proven gap, 1 - lower bound / energy, of random requests, by what is asked: full and partly free goals, objectives.

    python -m benchmarks.gaps --count 20
    python -m benchmarks.gaps --count 15 --tight

Every task asks for the same motions in several ways: to a configuration, to its pose, to this pose with a free rotation
about the tool's axis or one across it, with the axis in a cone of 0.3 rad, with any orientation, and the first two for
least mechanical work in a given duration. `--tight` solves to a configuration and to its pose, with both bounds.
Collisions are ignored, so that every task has a motion.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.command import on_one_core, parser, write_json
from benchmarks.reference import problem_of
from benchmarks.statistics import Spread
from benchmarks.tasks import moves
from joulepath.models.registry import load_robot
from joulepath.optimizer.energy.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solution import Solution

AXIS, ACROSS = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
HALF_ANGLE = 0.3  # of the cone [rad]

GOALS: dict[str, Callable[[Pose], Pose | ConeOrientedPose]] = {
    "pose": lambda pose: pose,
    "about the tool": lambda pose: ConeOrientedPose.about(pose, AXIS),
    "about an axis across": lambda pose: ConeOrientedPose.about(pose, ACROSS),
    "cone": lambda pose: ConeOrientedPose(pose.T[:3, 3], AXIS, pose.T[:3, 2], HALF_ANGLE),
    "any orientation": lambda pose: ConeOrientedPose(pose.T[:3, 3]),
}


def asked(seed: int, count: int, deadline: float) -> Iterator[tuple[str, Problem]]:
    """Every task in every way, by kind."""
    for task in moves(seed, count):
        electrical, mechanical = (
            replace(problem_of(task, objective), deadline=deadline) for objective in ("electrical", "mechanical")
        )
        goal = Pose(tcp_pose(electrical.arm, task.q_goal))
        yield "configuration", electrical
        for name, make in GOALS.items():
            yield name, replace(electrical, goal=make(goal))
        yield "configuration, mechanical", mechanical
        yield "pose, mechanical", replace(mechanical, goal=goal)


def solved(problem: Problem) -> tuple[Solution | None, float]:
    """The answer, None for a refusal, and the time that it took [s]."""
    began = time.perf_counter()
    try:
        solution = optimize(problem)
    except JoulepathError as error:
        print(f"{error!r}")
        solution = None
    return solution, time.perf_counter() - began


def gap(solution: Solution, problem: Problem) -> float:
    """1 - lower bound / energy; 1 where recovered energy makes the energy negative or zero."""
    energy = solution.energy.of(problem.objective)
    return 1 - solution.lower_bound / energy if energy > 0 else 1.0


def main() -> None:
    """Solves every task, and prints the gaps and the times by kind."""
    arguments = parser(__doc__, seed=2)
    arguments.add_argument("--count", type=int, default=20, help="tasks (%(default)s)")
    arguments.add_argument("--deadline", type=float, default=30.0, help="deadline of a request [s] (%(default)s)")
    arguments.add_argument("--tight", action="store_true", help="compare the normal with the tight bound")
    given = arguments.parse_args()
    on_one_core()
    compile_kernel(load_robot("ur5e"))
    optimize(next(asked(given.seed, 1, given.deadline))[1])  # the first one loads what the others find loaded
    gaps: dict[str, list[float]] = {}
    times: dict[str, list[float]] = {}
    for kind, problem in asked(given.seed, given.count, given.deadline):
        if given.tight and kind not in ("configuration", "pose"):
            continue
        for bound in ("normal", "tight") if given.tight else ("normal",):
            name = f"{kind}, {bound}" if given.tight else kind
            solution, wall = solved(replace(problem, bound=bound))
            if solution is not None:
                gaps.setdefault(name, []).append(gap(solution, problem))
                times.setdefault(name, []).append(wall)
    results = {name: {"gap": Spread.of(gaps[name]), "time": Spread.of(times[name])} for name in gaps}
    for name, found in results.items():
        quantiles = f"gap median {found['gap'].p50:.1%}, 90th percentile {found['gap'].p90:.1%}"
        print(f"{name:26s} {len(gaps[name]):3d} answers, {quantiles}, time median {found['time'].p50:.2f} s")
    write_json(given.json, {"seed": given.seed, "count": given.count} | results)


if __name__ == "__main__":
    main()
