"""Energies of slow moves, relative to the best of their variants with other durations, spline
spaces and methods.

    python -m benchmarks.energies --kind slow --count 200

The moves alternate between three kinds: all joints no faster than REDUCED, one joint with a speed
limit from ONE_JOINT, and all joints at TENTH of their speed limits. The variants of an answer have
fixed durations near its duration, four times as many control points (evenly spaced, or between the
knots of the answer), or the Lagrange method. The exit code is 1 if the 95th percentile of the
excess over the best variant is above MOST_EXCESS.
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
from joulepath.optimizer.problem.robots import load_robot
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
MOST_EXCESS = 3e-3
"""Largest admissible 95th percentile of the relative excess [1]."""
NEAR = (0.9, 0.97, 0.99, 0.997, 1.003, 1.01, 1.03, 1.1)
"""Durations of variants over the duration of the answer [1]."""
CONTROL_POINTS = 13
"""Control points of a first solve."""
REFINEMENT = 4
"""Factor on the number of control points in the fine solve."""
PROGRESS = 1e-5
"""Relative decrease of the energy at which a fine solve ends [1]."""
UNREACHED_DEADLINE = 600.0
"""Deadline that no search reaches [s]."""


def slow_problem(seed: int, index: int) -> tuple[SlowKind, Problem]:
    """The kind of task `index` of a seed, and its problem."""
    robot, kind, task = load_robot("ur5e"), SLOW_KINDS[index % len(SLOW_KINDS)], move(seed, index)
    rng, v_max = np.random.default_rng([seed, index, 1]), robot.limits.v_max.copy()
    if kind == "all joints":
        v_max = np.minimum(v_max, REDUCED)
    elif kind == "one joint":
        v_max[rng.integers(robot.nq)] = np.exp(rng.uniform(*np.log(ONE_JOINT)))
    else:
        v_max *= TENTH
    arm = Arm(robot=robot, limits=replace(robot.limits, v_max=v_max), collisions=False)
    return kind, Problem(arm=arm, start=task.q_start, goal=task.q_goal, deadline=UNREACHED_DEADLINE)


def other_searches(problem: Problem, duration: float) -> Iterator[tuple[str, float]]:
    """Names and energies [J] of variants of a move: with fixed durations near its `duration` [s],
    and by the Lagrange method.
    """
    for factor in NEAR:
        fixed = duration * factor
        with suppress(JoulepathError):
            yield (
                f"{factor:g} T",
                _energy(replace(problem, duration_min=fixed, duration_max=fixed)),
            )
    with suppress(JoulepathError):
        yield "lagrange", _energy(replace(problem, method="lagrange"))


def more_points(problem: Problem, spline: Spline) -> Iterator[tuple[str, float]]:
    """Names and energies [J] of variants of a move in larger spline spaces, solved from its
    answer's motion."""
    prepared = PreparedProblem.of(problem)
    q_start, q_goal = spline.control_points[[0, -1]]
    solver = FreeSpline(SolveContext.of(prepared, q_start, q_goal, NEVER))
    q, t = sampled(spline)
    space = bspline.uniform(REFINEMENT * CONTROL_POINTS)
    points = bspline.smoothed(q, t / spline.duration, space.knots)
    evenly = solver.solve_control_points(space, points, spline.duration, PROGRESS)
    yield "evenly", prepared.cost_of(evenly.spline)
    yield "finer", prepared.cost_of(_finer(solver, spline).spline)


def _energy(problem: Problem) -> float:
    return optimize(problem).energy.electrical.total


def _finer(solver: FreeSpline, spline: Spline) -> SolveResult:
    """A solve from a motion, in a spline space with every span divided into REFINEMENT spans."""
    duration = spline.duration
    knots: Array = spline.knots / duration
    inserted = [np.linspace(a, b, REFINEMENT + 1)[1:-1] for a, b in pairwise(np.unique(knots))]
    space = Basis.of(np.sort(np.concatenate([knots, *inserted])))
    points = bspline.refit(spline.control_points, knots, space.knots)
    return solver.improve(Guess(space, points, duration, nearly_feasible=True, progress=PROGRESS))


def compare(seed: int, count: int, json: Path | None) -> int:
    """Solves the moves and their variants, and prints the excess over the best variants; returns 1
    if it is too large.
    """
    rows = []
    for index in range(count):
        kind, problem = slow_problem(seed, index)
        began = time.process_time()
        answer = optimize(problem)
        spent = time.process_time() - began
        energy, spline = answer.energy.electrical.total, answer.trajectory.spline
        variants = dict(other_searches(problem, spline.duration)) | dict(
            more_points(problem, spline)
        )
        best = min(variants, key=lambda name: variants[name])
        row: dict[str, Any] = {
            "index": index,
            "kind": kind,
            "energy": energy,
            "duration": answer.duration,
            "excess": max(energy / variants[best] - 1, 0.0),
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
