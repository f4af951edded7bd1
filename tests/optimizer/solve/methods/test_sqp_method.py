"""Solves of one candidate from guess to motion, within all limits between the nodes too."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion.seven_segment import ramp, shortest_duration
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods import METHODS, solver_for
from joulepath.optimizer.solve.methods import duration_intervals as duration_intervals
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveResult, SolveStatus
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    limits,
    problem,
    random_moves,
    torques,
)
from tests.selection import long_but

# samples of a motion, apart from all grids of the optimiser
SAMPLES = 3001
# relative excess over a limit, as of the certificate
LIMIT_TOLERANCE = 1e-6
ROUNDING = 1e-9

CONDITIONS: list[dict[str, Any]] = [
    {},
    {"payload": PAYLOAD, "gravity": TILTED},
    {"limits": limits(tau_max=[60, 120, 60, 14, 14, 14])},
    {"limits": limits(v_max=1.0, a_max=3.0, j_max=15.0), "payload": PAYLOAD},
    {"friction": "coulomb_viscous", "limits": limits(j_max=25.0)},
]


def solver(
    start: Array,
    goal: Array,
    fastest: bool = False,
    wait: float = 60.0,
    **given: Any,
) -> Method:
    compile_kernel(ROBOT)
    task = PreparedProblem.of(problem(start, goal, **given))
    interval = duration_intervals.fastest(task) if fastest else None
    context = SolveContext.of(task, start, goal, Deadline.after(wait), interval)
    return solver_for(context)


def spline(attempt: SolveResult) -> Spline:
    assert attempt.status is SolveStatus.SOLVED and attempt.spline is not None, attempt.message
    return attempt.spline


def assert_held(task: Problem, motion: Spline) -> None:
    """All limits at samples apart from the optimiser's grids, by SciPy and Pinocchio."""
    own = task.arm.active_limits
    curve = BSpline(motion.knots, motion.control_points, motion.degree)
    t = np.linspace(0.0, motion.duration, SAMPLES)
    q, v, a, jerk = (curve(t, d) for d in range(4))
    tau = torques(task, q, v, a) + task.arm.friction_law.torque(v)
    for values, maxima in ((v, own.v_max), (a, own.a_max), (jerk, own.j_max), (tau, own.tau_max)):
        assert (np.abs(values) <= maxima * (1 + LIMIT_TOLERANCE)).all()
    assert (q >= own.q_min - ROUNDING).all() and (q <= own.q_max + ROUNDING).all()
    assert np.abs(v[[0, -1]]).max() < 1e-8 and np.abs(a[[0, -1]]).max() < 1e-6
    assert q[0] == pytest.approx(np.asarray(task.start), abs=ROUNDING)
    assert q[-1] == pytest.approx(np.asarray(task.goal), abs=ROUNDING)


@pytest.mark.parametrize(
    ("method", "objective"),
    long_but(
        [("bspline", "mechanical"), ("time_scaling", "electrical")],
        product(METHODS, ("electrical", "mechanical")),
    ),
)
def test_limits_hold_between_the_nodes(method: str, objective: str) -> None:
    for (start, goal), given in zip(random_moves(31, len(CONDITIONS)), CONDITIONS, strict=True):
        own = given.get("limits", ROBOT.limits)
        longest = (
            None if objective == "electrical" else 2.0 * float(shortest_duration(goal - start, own))
        )
        mine = solver(
            start, goal, method=method, objective=objective, duration_max=longest, **given
        )
        attempt = mine.solve()
        if method == "time_scaling" and attempt.status is SolveStatus.INFEASIBLE:
            continue  # a straight line may lead where the arm cannot be held
        assert_held(mine.prepared.problem, spline(attempt))
        assert attempt.iterations > 0 and attempt.solves > 0


def test_a_time_scaled_motion_stays_on_its_line() -> None:
    """All control points, hence all points, lie on the line in order."""
    for start, goal in random_moves(32, 4):
        points = spline(solver(start, goal, method="time_scaling").solve()).control_points
        displacement = goal - start
        fraction = (points - start) @ displacement / (displacement @ displacement)
        assert np.abs(points - start - np.outer(fraction, displacement)).max() < ROUNDING
        assert fraction[0] == pytest.approx(0, abs=ROUNDING) and fraction[-1] == pytest.approx(
            1, abs=ROUNDING
        )


def test_minimum_time_ignores_the_duration_asked_for() -> None:
    """The fastest motion ignores the requested duration, so as to report the possible one."""
    quick = spline(solver(START, GOAL, fastest=True).solve()).duration
    for given in (fixed(0.1), fixed(5.0)):
        assert spline(solver(START, GOAL, fastest=True, **given).solve()).duration == pytest.approx(
            quick, rel=1e-9
        )


@pytest.mark.parametrize("method", METHODS)
def test_a_deadline_that_has_passed_ends_the_attempt(method: str) -> None:
    attempt = solver(START, GOAL, method=method, wait=-1.0).solve()
    assert attempt.status is SolveStatus.OUT_OF_TIME and attempt.spline is None


def slowly(speed: float, **given: object) -> FreeSpline:
    """Method of a move with joints limited to a speed [rad/s]."""
    own = solver(START, GOAL, **{"limits": limits(v_max=speed)} | given)
    assert isinstance(own, FreeSpline)
    return own


def test_a_slow_motion_has_its_first_knots_at_the_ramps_and_is_refined_from_itself() -> None:
    own = slowly(0.1)
    coarse = own.solve()
    motion, cost = spline(coarse), own.prepared.cost_of
    breaks = np.unique(motion.knots) / motion.duration
    shortest_span = breaks[1] * motion.duration
    assert shortest_span < ramp(GOAL - START, own.coordinates.limits) and own.may_refine(motion)
    finer = own.refined(motion, fine=True)
    assert not own.may_refine(spline(finer))
    assert cost(spline(finer)) < cost(motion)
    assert_held(own.prepared.problem, spline(finer))


@pytest.mark.parametrize(
    "given", [{}, {"objective": "mechanical", "duration_max": 15.0}, {"limits": ROBOT.limits}]
)
def test_other_first_knots_are_evenly_spaced(given: dict[str, object]) -> None:
    """First knots are evenly spaced at the robot's speed limits, and for least work.

    Least work has no longest useful time.
    """
    own = slowly(0.1, **given)
    even = bool(np.ptp(np.diff(np.unique(spline(own.solve()).knots))) < 1e-9)
    assert even is bool(given)
