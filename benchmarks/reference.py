"""Reference energies of seeded tasks: the best results of two solvers from many initial guesses.

    python -m benchmarks.reference

The command writes benchmarks/reference_energies.json in about half an hour. An interrupted run
continues when the command is started again. `make bench` compares answers with these energies.

The SQP of joulepath solves every task with POINTS control points from STARTS initial guesses: the
straight line, and random perturbations of it. IPOPT solves the task with the same spline from
IPOPT_STARTS initial guesses. The SQP refines the motions of IPOPT, so that they also satisfy the
limits between the nodes, and finally the best motion with twice as many spans. The limits are the
limits of the robot, and the duration is free.
"""

from __future__ import annotations

import hashlib
import multiprocessing
from dataclasses import fields
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from benchmarks.command import on_one_core, parser
from benchmarks.planners.casadi_opti import CasadiOptiGrid
from benchmarks.tasks import Move, move
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_context import SolveContext

FILE = Path(__file__).with_name("reference_energies.json")
SEED = 1
TASKS = 100
STARTS = 64
"""Number of initial guesses of the SQP per task."""
POINTS = 25
"""Number of control points."""
IPOPT_STARTS = 4
"""Number of initial guesses of IPOPT per task."""
FINE_POINTS = 45
"""Number of control points of the final refinement, with spans of half the length."""
MODES = 3
"""Number of half waves of a perturbation."""
PERTURBATIONS = (0.1, 1.5)
"""Smallest and largest standard deviation of the amplitudes of half waves [rad]."""
SOLVE_TIME = 60.0
"""Longest time of the solve from one initial guess [s]."""
PROCESSES = 2
"""Number of processes."""


def perturbation(rng: np.random.Generator, space: bspline.Basis, nq: int) -> Array:
    """Random displacement (m, nq) [rad] of the m free control points of an initial guess, by half
    waves over the motion.
    """
    size = np.exp(rng.uniform(*np.log(PERTURBATIONS)))
    at = bspline.greville(space.knots)[space.free]
    waves = np.sin(np.pi * np.outer(at, np.arange(1, MODES + 1)))
    return np.asarray(
        waves @ (rng.normal(size=(MODES, nq)) * (size / np.arange(1, MODES + 1)[:, None]))
    )


@cache
def _opti() -> CasadiOptiGrid:
    return CasadiOptiGrid(load_robot("ur5e"), POINTS, 2 * POINTS + 11)


def problem_of(task: Move) -> Problem:
    """The problem of a task."""
    arm = Arm(robot=load_robot("ur5e"), collisions=False)
    return Problem(arm=arm, start=task.q_start, goal=task.q_goal)


class Search:
    """The best known motion of one task, and its exact energy in the objective [J]."""

    def __init__(self, task: Move) -> None:
        self.move = task
        self.prepared = PreparedProblem.of(problem_of(task))
        self.best: Spline | None = None
        self.energy = np.inf

    def improve(self, guess: Guess) -> float:
        """Solves from an initial guess, keeps the best motion, and returns the energy reached [J],
        inf without a motion."""
        interval = duration_intervals(self.prepared, self.move.q_goal)[0]
        deadline = Deadline.after(SOLVE_TIME)
        context = SolveContext(
            self.prepared, self.move.q_start, self.move.q_goal, deadline, interval
        )
        spline = FreeSpline(context).improve(guess).spline
        if spline is None:
            return float("inf")
        energy = self.prepared.objective_of(self.prepared.energy(spline))
        if energy < self.energy:
            self.best, self.energy = spline, energy
        return float(energy)


def search(seed: int, index: int) -> dict[str, Any]:
    """The results of one task, with energies in J."""
    task = move(seed, index)
    found, space = Search(task), bspline.uniform(POINTS)
    nq = len(task.q_start)
    straight = task.q_start + np.outer(space.quintic, task.q_goal - task.q_start)
    rng = np.random.default_rng([seed, index, 1])

    def guess(points: Array) -> Guess:
        return Guess(space, points, 0.0)

    def perturbed() -> Array:
        points = straight.copy()
        points[space.free] += perturbation(rng, space, nq)
        limits = found.prepared.problem.arm.active_limits
        return np.clip(points, limits.q_min, limits.q_max)

    from_line = found.improve(guess(straight))
    energies = [from_line, *(found.improve(guess(perturbed())) for _ in range(STARTS - 1))]
    by_ipopt = [_ipopt(found, perturbed() - straight if k else None) for k in range(IPOPT_STARTS)]
    least = found.energy
    if found.best is not None:
        fine = bspline.uniform(FINE_POINTS)
        unit = found.best.knots / found.best.duration
        points = bspline.refit(found.best.control_points, unit, fine.knots)
        found.improve(Guess(fine, points, found.best.duration))
    solved = [energy for energy in energies if np.isfinite(energy)]
    return {
        "index": index,
        "energy": least,
        "fine": found.energy,
        "duration": None if found.best is None else found.best.duration,
        "from_line": from_line,
        "by_ipopt": min(by_ipopt, default=float("inf")),
        "starts_solved": len(solved),
        "starts_within_a_thousandth": sum(energy <= 1.001 * least for energy in solved),
    }


def _ipopt(found: Search, moved: Array | None) -> float:
    opti = _opti()
    task = found.move
    motion = opti.plan(task.q_start, task.q_goal, None if moved is None else moved[opti.basis.free])
    if motion is None:
        return float("inf")
    return found.improve(Guess(bspline.uniform(POINTS), motion.control_points, motion.duration))


def fingerprint(robot: Robot) -> str:
    """Hash of all parameters of a robot that influence energies and limits. References are valid
    for one fingerprint only.
    """
    friction = next(iter(robot.friction_laws.values()))
    parts_of = (robot.limits, robot.drives, friction, robot.electronics)
    # `vars` would also contain cached properties
    parameters = {each.name: getattr(part, each.name) for part in parts_of for each in fields(part)}
    # Names are no parameters. Joint ranges hardly limit motions between configurations within them.
    left_out = {"name", "q_min", "q_max"}
    # terms of friction without effect for this robot
    left_out |= {term for term in ("load", "bend") if not np.any(parameters[term])}
    parts = [np.atleast_1d(v) for k, v in parameters.items() if k not in left_out]
    parts += [placement.homogeneous.ravel() for placement in robot.model.jointPlacements]
    parts += [body.toDynamicParameters() for body in robot.model.inertias]
    text = " ".join(f"{value:.9g}" for value in np.round(np.concatenate(parts), 12).tolist())
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def load() -> dict[str, Any]:
    """The stored reference energies."""
    content: dict[str, Any] = orjson.loads(FILE.read_bytes())
    return content


def main() -> None:
    """Solves the tasks and stores the results."""
    given = parser(__doc__, seed=SEED).parse_args()
    on_one_core()
    robot = load_robot("ur5e")
    compile_kernel(robot)
    settings = {
        "robot": robot.name,
        "fingerprint": fingerprint(robot),
        "seed": given.seed,
        "starts": STARTS,
        "ipopt_starts": IPOPT_STARTS,
        "control_points": POINTS,
        "fine_control_points": FINE_POINTS,
    }
    stored = load() if FILE.exists() else {}
    is_continued = {name: stored.get(name) for name in settings} == settings
    rows: list[dict[str, Any]] = stored["tasks"] if is_continued else []
    remaining = set(range(TASKS)) - {row["index"] for row in rows}
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as pool:
        for row in pool.imap_unordered(partial(search, given.seed), sorted(remaining)):
            rows = sorted([*rows, row], key=lambda each: int(each["index"]))
            print(row, flush=True)
            FILE.write_bytes(
                orjson.dumps({**settings, "tasks": rows}, option=orjson.OPT_INDENT_2) + b"\n"
            )


if __name__ == "__main__":
    main()
