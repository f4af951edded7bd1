"""Energies of answers without obstacles, relative to the best of many local solves.

    python -m benchmarks.many_starts --count 36
    python -m benchmarks.many_starts --count 12 --objective mechanical --guesses 1000

The tasks alternate between objectives, kinds of targets, fixed and free durations, and ROBOTS; half
of them have a payload. The local solves start from random motions between random pairs of postures
at the targets: all branches, full turns and samples of self-motions. Pairs and motions are chosen
independently of the search. For mechanical work, the random motions are first solved coarsely. The
best solves of different kinds are refined. For every task, the command prints the excess of the
answer over the best solve, and the differences of their durations, of their ends, and of every
joint along the motion. The exit code is 1 if the 95th percentile of the excess is above
MOST_EXCESS.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from benchmarks.command import on_one_core, parser, verdict
from benchmarks.statistics import Spread
from benchmarks.tasks import collision_free, flange
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.search.attempts import improve
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.coarse_motions import COARSE, CoarseMotion, CoarseSolver
from joulepath.optimizer.search.errors import DurationTooShort
from joulepath.optimizer.search.refinement import refine
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.seeds import estimates
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveResult

ROBOTS = ("ur5e", "panda", "iiwa14")
OBJECTIVES = ("mechanical", "electrical")
KINDS = tuple(product(("joint", "pose", "poses"), ("fixed", "free")))
"""Kinds of targets (joint positions to joint positions, joint positions to a pose, or pose to pose)
and of durations."""
DURATIONS = 1.0, 2.4
"""Smallest and largest requested duration [s]; it is extended if no motion is as fast."""
MASSES = 0.5, 2.9
"""Smallest and largest payload [kg]."""
MOST_EXCESS = 1e-2
"""Largest admissible 95th percentile of the relative excess [1]."""
UNREACHED_DEADLINE = 600.0
"""Deadline that no search reaches [s]."""
BATCH = 40
"""Number of coarse motions that are solved together."""
WAVES = 3
"""Number of half waves of a random motion."""
AMPLITUDES = 0.3, 5.0
"""Smallest and largest standard deviation of the amplitudes of half waves [rad]."""
MOST_PAIRS = 2000
"""Number of pairs of postures from which guesses are drawn; they have the lowest estimates."""
GUESS_DURATIONS = 1.05, 2.0
"""Range of the durations of guesses over the shortest duration, for a free duration [1]."""
SOLVED_GUESSES = 14
"""Number of coarse motions that are solved finely."""
REFINED_GUESSES = 5
"""Number of solved motions that are refined."""
KIND_DISTANCE = 0.3
"""Distance between control points above which two motions are of different kinds [rad]."""


def problem_of(seed: int, index: int, objective: str) -> Problem:
    """Task `index` of a seed."""
    rng = np.random.default_rng([seed, index])
    targets, duration = KINDS[index % len(KINDS)]
    robot = load_robot(ROBOTS[(index // len(KINDS) + index) % len(ROBOTS)])
    q_start, q_goal = collision_free(rng, robot), collision_free(rng, robot)
    mass = float(rng.uniform(*MASSES)) if rng.random() < 0.5 else 0.0
    longest = float(rng.uniform(*DURATIONS))
    arm = Arm(robot=robot, payload=Payload(mass=mass, com=np.array([0.0, 0.0, 0.08])))
    timed = duration == "fixed" or objective == "mechanical"
    return Problem(
        arm=arm,
        start=Pose(flange(robot, q_start)) if targets == "poses" else q_start,
        goal=q_goal if targets == "joint" else Pose(flange(robot, q_goal)),
        objective="mechanical" if objective == "mechanical" else "electrical",
        duration_min=longest if duration == "fixed" else None,
        duration_max=longest if timed else None,
        deadline=UNREACHED_DEADLINE,
    )


def guess(rng: np.random.Generator, candidate: Candidate, arm: Arm) -> CoarseMotion:
    """A random motion of a candidate; in a third of the motions, at most two joints deviate from
    the straight line in joint space."""
    space, rest, limits = (
        bspline.uniform(COARSE.control_points),
        bspline.REST_POINTS,
        arm.active_limits,
    )
    half_waves, nq = np.arange(1, WAVES + 1), len(candidate.q_start)
    waves = np.sin(np.pi * np.outer(bspline.greville(space.knots), half_waves))
    size = np.exp(rng.uniform(*np.log(AMPLITUDES)))
    amplitude = rng.normal(size=(WAVES, nq)) * size / half_waves[:, None]
    if rng.random() < 1 / 3:
        amplitude *= np.isin(np.arange(nq), rng.integers(nq, size=2))
    line = candidate.q_start + np.outer(space.quintic, candidate.q_goal - candidate.q_start)
    points = np.clip(line + waves @ amplitude, limits.q_min, limits.q_max)
    points[:rest], points[-rest:] = candidate.q_start, candidate.q_goal
    return CoarseMotion(candidate, points)


def guesses(rng: np.random.Generator, state: SearchState, count: int) -> list[CoarseMotion]:
    """Random motions; for mechanical work, coarsely solved motions of different kinds."""
    pool = [each for each in state.candidates if each.holdable and np.isfinite(each.lower_bound)]
    order = np.argsort(estimates(state.prepared, pool), kind="stable")[:MOST_PAIRS]
    near = np.minimum(rng.exponential(8.0, count).astype(int), len(order) - 1)
    chosen = np.where(rng.random(count) < 0.6, rng.integers(len(order), size=count), near)
    drawn = [guess(rng, pool[order[k]], state.prepared.arm) for k in chosen.tolist()]
    if state.problem.objective == "electrical":
        return drawn
    solver = CoarseSolver(state.prepared, float(state.problem.duration_max or 0.0))
    coarse = [
        each
        for k in range(0, count, BATCH)
        for each in solver.solved(
            drawn[k : k + BATCH], COARSE.control_points, SMOOTHING.power_width, 1e-2, 1.4
        )
    ]
    coarse.sort(key=lambda each: each.work)
    return [coarse[k] for k in _kinds([each.points for each in coarse], SOLVED_GUESSES)]


def best_of_many(problem: Problem, count: int, seed: Sequence[int]) -> tuple[float, Spline | None]:
    """The least energy [J] of many local solves, with its motion; inf if none is certified."""
    if problem.objective == "mechanical":
        # Rest needs no work, so no shorter motion needs less work than the longest one.
        problem = replace(problem, duration_min=problem.duration_max)
    rng, run = np.random.default_rng(seed), Run(problem)
    run.prepare()
    state = run.state
    # prevents the search from solving its own random motions
    state.sliding_work_sought = True
    solved = list[Candidate]()
    for each in guesses(rng, state, count):
        fresh = Candidate(*(getattr(each.candidate, name) for name in ENDS))
        fresh.shortest = each.candidate.shortest
        duration = problem.duration_max or fresh.shortest * rng.uniform(*GUESS_DURATIONS)
        improve(state, fresh, partial(_solved, each.points, float(duration)))
        if fresh.energy is not None:
            solved.append(fresh)
    solved.sort(key=lambda each: each.energy or 0.0)
    best: tuple[float, Spline | None] = np.inf, None
    for k in _kinds([each.spline.control_points for each in solved], REFINED_GUESSES):
        state.candidates = [solved[k]]
        refine(state, solved[k])
        energy, spline = solved[k].energy or 0.0, solved[k].spline
        if energy < best[0] and state.confirmed_energy(solved[k], spline) is not None:
            best = energy, spline
    return best


ENDS = ("start", "goal", "q_start", "q_goal")


def _solved(points: Array, duration: float, solver: Method) -> SolveResult:
    """A solve from a motion with control points (n, nq) [rad] and a duration [s]."""
    return solver.solve_control_points(bspline.uniform(len(points)), points, duration)


def _kinds(points: Sequence[Array], most: int) -> list[int]:
    """Indices of the first `most` motions of different kinds, by control points (n, nq) [rad]."""
    kept = list[int]()
    for k, each in enumerate(points):
        if all(np.abs(each - points[other]).max() > KIND_DISTANCE for other in kept):
            kept.append(k)
        if len(kept) == most:
            break
    return kept


def difference(answer: Spline, other: Spline) -> str:
    """The differences of another motion from an answer, as text."""
    at = np.linspace(0.0, 1.0, 101)
    q, q_other = (each.curve(at * each.duration) for each in (answer, other))
    apart = np.abs(q_other - q)
    joints = " ".join(f"{each:.2f}" for each in apart.max(axis=0))
    return (
        f"{answer.duration:.3f} s -> {other.duration:.3f} s, start {apart[0].max():.2f}, goal "
        f"{apart[-1].max():.2f}, on the way {joints} rad"
    )


def run_task(seed: int, index: int, objective: str, count: int) -> dict[str, Any] | None:
    """The outcome of a task; None without a motion."""
    problem = problem_of(seed, index, objective)
    compile_kernel(problem.arm.robot)
    name = f"{index:3d} {problem.arm.robot.name:7}{objective:11}{' '.join(KINDS[index % 6]):12}"
    try:
        try:
            optimize(problem)
        except DurationTooShort as error:
            least = 1.15 * (error.shortest or DURATIONS[1])
            short = None if problem.duration_min is None else least
            problem = replace(problem, duration_min=short, duration_max=least)
        began = time.process_time()
        answer = optimize(problem)
    except JoulepathError as error:
        print(f"{name} {type(error).__name__}", flush=True)
        return None
    spent, energy = time.process_time() - began, answer.energy.of(problem.objective)
    least_energy, spline = best_of_many(problem, count, [seed, index])
    if spline is None:
        print(f"{name} no start leads to a motion", flush=True)
        return None
    excess = (energy - least_energy) / abs(least_energy)
    other = difference(answer.trajectory.spline, spline) if excess > 0 else ""
    print(f"{name} {energy:9.3f} J {spent:6.2f} s {100 * excess:+7.2f} % {other}", flush=True)
    return {"name": name, "energy": energy, "excess": max(excess, 0.0), "time": spent}


def main() -> int:
    """Runs the command; returns the exit code."""
    arguments = parser(__doc__)
    arguments.add_argument("--count", type=int, default=36, help="tasks (%(default)s)")
    arguments.add_argument("--guesses", type=int, default=400, help="per task (%(default)s)")
    arguments.add_argument("--objective", choices=OBJECTIVES, help="(default: alternately)")
    given = arguments.parse_args()
    on_one_core()
    objectives = [
        given.objective or OBJECTIVES[k // len(KINDS) % len(OBJECTIVES)] for k in range(given.count)
    ]
    rows = [run_task(given.seed, k, each, given.guesses) for k, each in enumerate(objectives)]
    found = [each for each in rows if each is not None]
    excess = Spread.of([each["excess"] for each in found])
    within = sum(each["excess"] <= MOST_EXCESS for each in found) / max(len(found), 1)
    print(f"above the best of many starts: {excess.times(100).formatted(' %', 2)}")
    print(f"within {MOST_EXCESS:.0%}: {within:.0%}")
    failed = [] if excess.p95 <= MOST_EXCESS else [f"95th percentile {excess.p95:.2%}"]
    return verdict(given.json, {"tasks": found, "excess": excess, "within": within}, failed)


if __name__ == "__main__":
    sys.exit(main())
