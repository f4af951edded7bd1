"""How far the energies of slow moves are above those of the same moves with other durations, spaces
and methods.

    python -m benchmarks.energies --kind slow --count 200

Three kinds take turns: all joints at no more than REDUCED, one joint at a speed of ONE_JOINT, all
at TENTH of their limits of speed. Each answer is compared with fixed durations near its own, with
four times the control points, evenly spaced and next to its own knots, and with the Lagrange
method. Exits with 1 if the 95th percentile of the excess over the best of them is above
MOST_EXCESS.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.command import write_json
from benchmarks.statistics import Spread
from benchmarks.tasks import move
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveResult

SlowKind = Literal["all joints", "one joint", "tenth"]
SLOW_KINDS: tuple[SlowKind, ...] = ("all joints", "one joint", "tenth")
REDUCED = 0.25
"""Speed limit of all joints in the kind `all joints` [rad/s]."""
ONE_JOINT = (0.02, 0.6)
"""Smallest and largest speed limit of the joint in the kind `one joint` [rad/s]."""
TENTH = 0.1
"""Share of the robot's speed limits in the kind `tenth` [1]."""
# greatest 95th percentile of the excess that is allowed
MOST_EXCESS = 3e-3
# durations that are tried, in multiples of the answer's
NEAR = (0.9, 0.97, 0.99, 0.997, 1.003, 1.01, 1.03, 1.1)
FEW = 13
"""Control points of a first solve."""
MORE = 4
"""Factor on the number of control points in the fine solve."""
PROGRESS = 1e-5
"""Relative decrease of the energy at which a fine solve ends [1]."""
# so long that no search ends early [s]
AMPLE = 600.0


def slow_problem(seed: int, index: int) -> tuple[SlowKind, Problem]:
    """Task `index` of a seed and its kind."""
    robot, kind, task = load_robot("ur5e"), SLOW_KINDS[index % len(SLOW_KINDS)], move(seed, index)
    rng, v_max = np.random.default_rng([seed, index, 1]), robot.limits.v_max.copy()
    if kind == "all joints":
        v_max = np.minimum(v_max, REDUCED)
    elif kind == "one joint":
        v_max[rng.integers(robot.nq)] = np.exp(rng.uniform(*np.log(ONE_JOINT)))
    else:
        v_max *= TENTH
    arm = Arm(robot=robot, limits=replace(robot.limits, v_max=v_max), collisions=False)
    return kind, Problem(arm=arm, start=task.q_start, goal=task.q_goal, deadline=AMPLE)


def other_searches(problem: Problem, duration: float) -> Iterator[tuple[str, float]]:
    """Energies [J] of the same move, each with its name, at durations near that of the answer and
    by another method.
    """
    for factor in NEAR:
        longest = duration * factor
        with suppress(JoulepathError):
            yield (
                f"{factor:g} T",
                _energy(replace(problem, duration_min=longest, duration_max=longest)),
            )
    with suppress(JoulepathError):
        yield "lagrange", _energy(replace(problem, method="lagrange"))


def more_points(problem: Problem, spline: Spline) -> Iterator[tuple[str, float]]:
    """Energies [J] of the same move, each with its name, from the answer's motion in larger
    spaces."""
    prepared = PreparedProblem.of(problem)
    q_start, q_goal = spline.control_points[[0, -1]]
    solver = FreeSpline(SolveContext.of(prepared, q_start, q_goal, NEVER))
    q, t = sampled(spline)
    space = bspline.uniform(MORE * FEW)
    points = bspline.smoothed(q, t / spline.duration, space.knots)
    evenly = solver.solve_control_points(space, points, spline.duration, PROGRESS)
    yield "evenly", prepared.cost_of(evenly.spline)
    yield "finer", prepared.cost_of(_finer(solver, spline).spline)


def _energy(problem: Problem) -> float:
    return optimize(problem).energy.electrical.total


def _finer(solver: FreeSpline, spline: Spline) -> SolveResult:
    """From a motion in the space with its own knots, and MORE times as many spans."""
    duration = spline.duration
    own: Array = spline.knots / duration
    breaks = np.unique(own)
    between = [np.linspace(a, b, MORE + 1)[1:-1] for a, b in pairwise(breaks)]
    space = Basis.of(np.sort(np.concatenate([own, *between])))
    points = bspline.refit(spline.control_points, own, space.knots)
    return solver.improve(Guess(space, points, duration, nearly_feasible=True, progress=PROGRESS))


def compare(seed: int, count: int, json: Path | None) -> int:
    """Solves the moves, prints how far they are above the best of their variants; 1 if that is too
    far.
    """
    rows = []
    for index in range(count):
        kind, problem = slow_problem(seed, index)
        began = time.process_time()
        answer = optimize(problem)
        spent = time.process_time() - began
        energy, spline = answer.energy.electrical.total, answer.trajectory.spline
        others = dict(other_searches(problem, spline.duration)) | dict(more_points(problem, spline))
        best = min(others, key=lambda name: others[name])
        row: dict[str, Any] = {
            "index": index,
            "kind": kind,
            "energy": energy,
            "duration": answer.duration,
            "excess": max(energy / others[best] - 1, 0.0),
            "best": best,
            "cpu": spent,
        }
        rows.append(row)
        print(
            f"{index:4d} {kind:10s} {energy:9.2f} J, {answer.duration:7.3f} s, excess "
            f"{row['excess']:7.3%} ({best}), {spent:.2f} s",
            flush=True,
        )
    for kind in SLOW_KINDS:
        excess = Spread.of([row["excess"] for row in rows if row["kind"] == kind])
        print(f"{kind:10s} excess {excess.times(100).formatted(' %', 3)}")
    excess = Spread.of([row["excess"] for row in rows])
    print(f"{'together':10s} excess {excess.times(100).formatted(' %', 3)}")
    write_json(json, {"seed": seed, "tasks": rows})
    return int(excess.p95 > MOST_EXCESS)
