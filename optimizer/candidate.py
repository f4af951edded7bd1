"""One start and goal pair from first guess to a motion that holds every limit between the nodes too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from models.robot import Array, Limits
from optimizer import shortest_line
from optimizer.bounds import LEAST_DURATION, LONGEST_DURATION
from optimizer.bspline import Basis, uniform
from optimizer.motion import Task, fine_samples, peak_rates, spline_of
from optimizer.nlp import Programme
from optimizer.solution import Spline
from optimizer.solve import FEASIBILITY, Result, solve

# control points of the first attempt, and of those that follow where it fails or its answer is refined: every one
# halves the knot spans of the one before, so that its space contains the other's motions
COARSE, FINE, FINEST = 13, 21, 37
# the solver works within limits tightened by this share, so that its own tolerance does not break the real ones
MARGIN = 2 * FEASIBILITY
# times that limits are tightened where the motion breaks them between the nodes
REPAIRS = 6
# how a repaired limit is tightened beyond the excess found
REPAIR_MARGIN = 2e-4
# first durations tried, in multiples of the shortest that the straight line allows
STRETCHES = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
# points per knot span at which torque is checked between the nodes
TORQUE_POINTS = 16


@dataclass(frozen=True)
class Attempt:
    """What came of a candidate; `cost` is the solver's smoothed objective [J], `result` where a warm start continues."""

    status: Literal["solved", "infeasible", "failed", "out of time"]
    reason: str
    iterations: int
    solves: int
    spline: Spline | None = None
    cost: float = float("inf")
    stationarity: float = float("inf")


@dataclass(frozen=True)
class Guess:
    """A first guess: all control points in joint space (n, nq) and a duration [s]."""

    points: Array
    duration: float


def attempt(
    task: Task,
    q_start: Array,
    q_goal: Array,
    deadline: float,
    spaces: Sequence[Basis] = (uniform(COARSE), uniform(FINE), uniform(FINEST)),
    guess: Guess | None = None,
    fastest: bool = False,
) -> Attempt:
    """Solve a candidate, with more control points where fewer give no motion within the limits.

    `fastest` minimises the duration in place of the problem's objective.
    """
    outcome = Attempt("failed", "not tried", 0, 0)
    for space in spaces:
        fresh = _attempt(task, q_start, q_goal, deadline, space, guess, fastest)
        outcome = replace(fresh, iterations=fresh.iterations + outcome.iterations, solves=fresh.solves + outcome.solves)
        if outcome.status in ("solved", "out of time"):
            break
    return outcome


def _programme(task: Task, q_start: Array, q_goal: Array, space: Basis, limits: Limits, fastest: bool) -> Programme:
    problem = task.problem
    t_min = LEAST_DURATION if problem.duration_min is None or fastest else problem.duration_min
    t_max = LONGEST_DURATION if problem.duration_max is None or fastest else problem.duration_max
    p = task.fastest_parameters if fastest else task.objective_parameters
    build = Programme.straight_line if problem.method == "time_scaling" else Programme.joint_space
    return build(task.kernel, space, p, q_start, q_goal, limits, t_min, t_max)


def _attempt(
    task: Task, q_start: Array, q_goal: Array, deadline: float, space: Basis, guess: Guess | None, fastest: bool
) -> Attempt:
    problem = task.problem
    limits = _scaled(problem.active_limits, 1 - MARGIN)
    programme = _programme(task, q_start, q_goal, space, limits, fastest)
    if problem.method == "time_scaling":
        law = shortest_line.shortest_law(task, q_start, q_goal)
        if law is None:
            return Attempt("infeasible", "the straight line needs more torque than the joints have", 0, 0)
        if law.duration_bound > programme.t_max:
            reason = f"the straight line takes at least {law.duration_bound:.4f} s"
            return Attempt("infeasible", reason, 0, 0)
        t_min = max(programme.t_min, law.duration_bound)
        programme = replace(programme, t_min=t_min)
        first = (law.fractions(programme.basis.knots)[programme.basis.free, None], t_min)
    elif guess is not None:
        first = (guess.points[programme.basis.free], guess.duration)
    else:
        first = (programme.straight(), 0.0)
    free, duration = first[0], _first_duration(programme, first[0], first[1])

    iterations, solves = 0, 0
    multiplier = None
    for _ in range(REPAIRS):
        result = solve(programme, free, duration, multiplier, deadline)
        iterations, solves = iterations + result.iterations, solves + 1
        if result.status == "out of time":
            return Attempt("out of time", "the deadline passed", iterations, solves)
        if result.violation > FEASIBILITY:
            reason = f"no motion of {space.n} control points holds the limits (worst excess {result.violation:.2g})"
            return Attempt("infeasible", reason, iterations, solves)
        excess = _excess(task, programme, result)
        if excess is None:
            spline = spline_of(programme.basis, programme.joint_points(result.free), result.duration)
            status: Literal["solved", "failed"] = "solved"
            return Attempt(status, "converged", iterations, solves, spline, result.cost, result.stationarity)
        limits = replace(
            limits,
            v_max=limits.v_max / excess.v_max,
            a_max=limits.a_max / excess.a_max,
            j_max=limits.j_max / excess.j_max,
            tau_max=limits.tau_max / excess.tau_max,
        )
        tight = _programme(task, q_start, q_goal, space, limits, fastest)
        programme = replace(programme, s_limits=tight.s_limits)
        free, duration, multiplier = result.free, result.duration, result.multiplier
    return Attempt("failed", "limits stay broken between the nodes", iterations, solves)


def _scaled(limits: Limits, factor: float) -> Limits:
    return replace(
        limits,
        v_max=limits.v_max * factor,
        a_max=limits.a_max * factor,
        j_max=limits.j_max * factor,
        tau_max=limits.tau_max * factor,
    )


def _first_duration(programme: Programme, free: Array, least: float) -> float:
    """The cheapest of a few durations at which the guess holds the limits on speed, acceleration and jerk."""
    peaks = np.abs(programme.kinematics(free)).max(axis=1) / programme.rates
    shortest = max(float((peaks.max(axis=1) ** (1 / np.arange(1, 4))).max()), least, programme.t_min)
    if shortest >= programme.t_max:
        return programme.t_max
    tau_max = programme.s_limits.tau_max
    best, chosen = np.inf, shortest
    for stretch in STRETCHES:
        duration = min(shortest * stretch, programme.t_max)
        cost, tau = programme.value(free, duration)
        cost *= 1 + float(np.maximum(np.abs(tau) / tau_max - 1, 0).max())
        if cost < best:
            best, chosen = cost, duration
        elif stretch > STRETCHES[1]:
            break
    return chosen


def _excess(task: Task, programme: Programme, result: Result) -> Limits | None:
    """By which factors (≥ 1) each limit must be tightened, None when the motion holds them all on a fine grid."""
    limits = task.problem.active_limits
    points = programme.joint_points(result.free)
    spline = spline_of(programme.basis, points, result.duration)
    _, q, v, a = fine_samples(spline, TORQUE_POINTS)
    tau = task.torques(q, v, a) + task.friction.torque(v)
    rates = peak_rates(spline)
    found = {
        "v_max": rates[0] / limits.v_max,
        "a_max": rates[1] / limits.a_max,
        "j_max": rates[2] / limits.j_max,
        "tau_max": np.abs(tau).max(axis=0) / limits.tau_max,
    }
    if max(float(ratio.max()) for ratio in found.values()) <= 1 - REPAIR_MARGIN / 4:
        return None
    factors = {name: np.where(r > 1 - REPAIR_MARGIN / 4, r + REPAIR_MARGIN, 1.0) for name, r in found.items()}
    one = np.ones_like(limits.q_min)
    return Limits(q_min=one, q_max=one, **factors)
