"""Energy of answers among obstacles against the best of many planned paths, each optimised by itself.

    python -m benchmarks.planned_paths --count 40 --seed 5
    python -m benchmarks.planned_paths --count 5 --file FILE

The tasks are those of `benchmarks.scenes`, or of each family in a file of others (docs/foreign_scenes.md), joint to
joint. The path planner draws so many paths with a seed each; every one is the initial guess of an optimisation to which
no other motion is known, so that none ends early. The REFINED best motions get the finer knots that answers have, too.
The exit code is 1 if too few answers are as near to the best of them as required.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.cells import CellTask, cell_tasks
from benchmarks.command import on_one_core, parser, write_json
from benchmarks.foreign import chosen, problems_of
from benchmarks.statistics import Spread
from joulepath import optimize
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.collision.path_planner import Effort, along, plan_paths
from joulepath.optimizer.collision.state_validity import ValidityCheckers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.methods.free_spline import FreeSpline
from joulepath.optimizer.methods.method import SolveResult
from joulepath.optimizer.optimize import warm_up
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.trajectories.spline import sampled

ROBOT = "ur5e"
# paths of a task, and motions of theirs that are refined
PATHS, REFINED = 20, 3
# time for one planning, one optimisation and one answer [s]: none ends early
AMPLE = 120.0
# an answer is near the best if it needs at most this much more; least fraction of answers that are
NEAR, REQUIRED = 0.02, 0.9


def own_problems(seed: int, count: int) -> Iterator[tuple[str, Problem]]:
    """Tasks of `benchmarks.cells`, with their names."""
    for task in cell_tasks(seed, count):
        yield task.name, problem_of(task)


def problem_of(task: CellTask) -> Problem:
    """A task in a random cell, joint to joint."""
    arm = task.arm
    own = Arm(robot=load_robot(ROBOT), scene=arm.scene, tool=arm.tool, T_flange_tcp=arm.T_flange_tcp)
    return Problem(arm=own, start=task.q_start, goal=task.q_goal, windings=False, deadline=AMPLE)


def problems_from(path: Path, count: int, seed: int) -> Iterator[tuple[str, Problem]]:
    """`count` problems of each family of a file, with their names."""
    problems = problems_of(path)
    for each in chosen(problems, list(dict.fromkeys(problem.family for problem in problems)), count, seed):
        yield each.name, to_problem(OptimizeRequest.model_validate(each.requests["joint"]), AMPLE)


def energies_of_paths(problem: Problem, q_start: Array, q_goal: Array, count: int) -> list[float]:
    """Energies [J], the least first, of motions from `count` planned paths; the best ones refined."""
    prepared, v_max = PreparedProblem.of(problem), problem.arm.active_limits.v_max
    checkers = ValidityCheckers(problem.arm, collision_model(problem.arm))

    def solver() -> FreeSpline:
        return FreeSpline(prepared, q_start, q_goal, Deadline.after(AMPLE))

    found: list[SolveResult] = []
    for seed in range(count):
        # seed 0 would be no seed to OMPL, and seed 1 is the planner's own
        planned = plan_paths(
            problem.arm, q_start, q_goal, Deadline.after(AMPLE), Effort(paths=1), seed=seed + 2, checkers=checkers
        )
        found += [solver().along_path(*along(path, 1.0, v_max)) for path in planned.paths]
    found = sorted(found, key=lambda result: prepared.cost_of(result.spline))
    finer = [solver().solve_from(*sampled(each.spline), fine=False) for each in found[:REFINED] if each.spline]
    return sorted(prepared.cost_of(each.spline) for each in (*found, *finer) if each.spline is not None)


def main() -> int:
    """Compares the answers, and checks the requirement."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=40, help="tasks, or problems of each family (%(default)s)")
    arguments.add_argument("--paths", type=int, default=PATHS, help="planned paths of a task (%(default)s)")
    arguments.add_argument("--file", type=Path, help="file of problems of others (own tasks)")
    given = arguments.parse_args()
    on_one_core()
    warm_up(ROBOT)
    problems = (
        own_problems(given.seed, given.count)
        if given.file is None
        else problems_from(given.file, given.count, given.seed)
    )
    excess = dict[str, float]()
    for name, problem in problems:
        assert isinstance(problem.start, np.ndarray) and isinstance(problem.goal, np.ndarray)
        energies = energies_of_paths(problem, problem.start, problem.goal, given.paths)
        try:
            energy = optimize(problem).energy.of(problem.objective)
        except JoulepathError as error:
            print(f"{name}: {error}")
            energy = np.inf
        # without a motion from any path there is nothing to compare with
        if energies or np.isinf(energy):
            excess[name] = energy / energies[0] - 1 if energies else np.inf
            print(
                f"{name:32s} {energy:8.2f} J, best of {len(energies)} motions {min(energies, default=0):8.2f} J",
                flush=True,
            )
    near = sum(each <= NEAR for each in excess.values()) / len(excess)
    spread = Spread.of(list(excess.values()))
    print(f"energy above the best of {given.paths} planned paths: {spread.times(100).formatted(' %', 2)}")
    print(f"least {100 * spread.minimum:.2f} %; at most {NEAR:.0%} above it: {near:.0%} of {len(excess)}")
    write_json(given.json, {"seed": given.seed, "paths": given.paths, "near": near, "excess": excess})
    if near < REQUIRED:
        print(f"FAILED: {near:.0%} of the answers are near the best, required {REQUIRED:.0%} or more")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
