"""Reference energies of seeded tasks: the best of many starts on a fine grid, by two independent
solvers.

    python -m benchmarks.reference            writes benchmarks/reference_energies.json, in about
    half an hour

A run that was interrupted continues when it is started again.

Each task is solved by joulepath's SQP from STARTS initial guesses (the straight line and random
perturbations of it) on POINTS control points, and by IPOPT from IPOPT_STARTS initial guesses on the
same spline. The SQP then refines IPOPT's motions, so that they satisfy the limits between the
nodes, too. Finally it refines the best motion on twice as many spans. Limits are those of the
robot, and the duration is free. `make bench` compares answers with the stored energies.
"""

from __future__ import annotations

import hashlib
import multiprocessing
from collections.abc import Callable
from dataclasses import fields
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from benchmarks.command import on_one_core, parser
from benchmarks.planners.casadi_opti import CasadiOptiGrid
from benchmarks.tasks import Move, move
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_context import SolveContext

FILE = Path(__file__).with_name("reference_energies.json")
SEED = 1
TASKS = 100
STARTS = 64  # initial guesses of the SQP per task
POINTS = 25  # control points
IPOPT_STARTS = 4  # initial guesses of IPOPT per task
FINE_POINTS = 45  # spans of half the length
MODES = 3  # half waves of a perturbation
PERTURBATIONS = (0.1, 1.5)  # least and largest standard deviation of the waves' amplitudes [rad]
PATIENCE = 60.0  # longest time for one start [s]


def perturbation(rng: np.random.Generator, space: bspline.Basis, nq: int) -> Array:
    """Random displacement (m, nq) [rad] of an initial guess's free control points: waves that
    vanish at both ends.
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
    """The best motion found for one task, and its exact energy [J] in the objective."""

    def __init__(self, task: Move) -> None:
        self.move = task
        self.prepared = PreparedProblem.of(problem_of(task))
        self.best: Spline | None = None
        self.energy = np.inf

    def improve(self, guess: Guess) -> float:
        """The energy [J] reached from an initial guess, inf without a motion. The best motion is
        stored.
        """
        interval = duration_intervals(self.prepared, self.move.q_goal)[0]
        deadline = Deadline.after(PATIENCE)
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


def search(seed: int, starts: int, ipopt_starts: int, index: int) -> dict[str, Any]:
    """The results for one task; energies in J."""
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
    energies = [from_line, *(found.improve(guess(perturbed())) for _ in range(starts - 1))]
    by_ipopt = [_ipopt(found, perturbed() - straight if k else None) for k in range(ipopt_starts)]
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
    """Hash of the robot's parameters that energies and limits depend on: references are valid for
    these only.
    """
    friction = next(iter(robot.friction_laws.values()))
    parts_of = (robot.limits, robot.drives, friction, robot.electronics)
    # not `vars`: it has what was computed from the fields, too
    parameters = {each.name: getattr(part, each.name) for part in parts_of for each in fields(part)}
    # names are no parameters, and joint ranges do not limit a motion between two configurations
    # within them
    left_out = {"name", "q_min", "q_max"}
    # terms of friction that the robot does not have
    left_out |= {term for term in ("load", "bend") if not np.any(parameters[term])}
    parts = [np.atleast_1d(v) for k, v in parameters.items() if k not in left_out]
    parts += [placement.homogeneous.ravel() for placement in robot.model.jointPlacements]
    parts += [body.toDynamicParameters() for body in robot.model.inertias]
    text = " ".join(f"{value:.9g}" for value in np.round(np.concatenate(parts), 12).tolist())
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def load(path: Path = FILE) -> dict[str, Any]:
    """The stored reference energies."""
    content: dict[str, Any] = orjson.loads(path.read_bytes())
    return content


def main() -> None:
    """Solves the tasks and stores the results."""
    arguments = parser(__doc__, seed=SEED)
    arguments.add_argument("--count", type=int, default=TASKS, help="tasks (%(default)s)")
    arguments.add_argument(
        "--starts", type=int, default=STARTS, help="initial guesses of the SQP (%(default)s)"
    )
    arguments.add_argument(
        "--ipopt-starts", type=int, default=IPOPT_STARTS, help="and of IPOPT (%(default)s)"
    )
    arguments.add_argument("--processes", type=int, default=2, help="processes (%(default)s)")
    arguments.add_argument("--output", type=Path, default=FILE, help="file to write (%(default)s)")
    given = arguments.parse_args()
    on_one_core()
    output: Path = given.output
    robot = load_robot("ur5e")
    compile_kernel(robot)
    settings = {
        "robot": robot.name,
        "fingerprint": fingerprint(robot),
        "seed": given.seed,
        "starts": given.starts,
        "ipopt_starts": given.ipopt_starts,
        "control_points": POINTS,
        "fine_control_points": FINE_POINTS,
    }
    before = load(output) if output.exists() else {}
    continued = {name: before.get(name) for name in settings} == settings
    rows: list[dict[str, Any]] = before["tasks"] if continued else []
    done = {row["index"] for row in rows}
    one: Callable[[int], dict[str, Any]] = partial(
        search, given.seed, given.starts, given.ipopt_starts
    )
    with multiprocessing.get_context("spawn").Pool(given.processes) as pool:
        for row in pool.imap_unordered(
            one, (index for index in range(given.count) if index not in done)
        ):
            rows = sorted([*rows, row], key=lambda each: int(each["index"]))
            print(row, flush=True)
            output.write_bytes(
                orjson.dumps({**settings, "tasks": rows}, option=orjson.OPT_INDENT_2) + b"\n"
            )


if __name__ == "__main__":
    main()
