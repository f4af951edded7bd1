"""The search for the fastest motion of one candidate."""

from __future__ import annotations

from dataclasses import replace

import pytest

from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import lasting
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.fastest import fastest_of
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, problem
from tests.optimizer.search.runs import prepared

SPLINE = lasting(time_optimal_spline(ROBOT.limits, START, GOAL), 2.0)


def asked(**given: object) -> Run:
    return prepared(problem(payload=PAYLOAD, **given))


def test_what_a_method_compares_is_what_its_interval_makes_least() -> None:
    state = asked().state
    models = state.prepared

    def cost(interval: DurationInterval) -> float:
        return FreeSpline(SolveContext.of(models, START, GOAL, state.deadline, interval)).cost_of(
            SPLINE
        )

    energy = models.cost_of(SPLINE)
    own = DurationInterval(models.objective_parameters, DURATIONS.least, DURATIONS.longest)
    assert cost(own) == energy
    assert cost(replace(own, price=30.0)) == pytest.approx(energy + 30.0 * SPLINE.duration)
    assert cost(fastest(models)) == SPLINE.duration
    assert FreeSpline(SolveContext.of(models, START, GOAL, state.deadline, own)).cost_of(
        None
    ) == float("inf")


def test_a_known_motion_counts_if_it_is_certified() -> None:
    """If a known spline is faster than any polynomial, it is the fastest motion."""
    splines, polynomials = asked().state, asked(method="lagrange").state
    known = fastest_of(splines, splines.candidates[0])
    candidate = polynomials.candidates[0]
    own = fastest_of(polynomials, candidate)
    assert known is not None and own is not None and known.duration < 0.99 * own.duration
    assert fastest_of(polynomials, candidate, [known]) is known
    too_fast = lasting(known, 0.9 * known.duration)
    found = fastest_of(polynomials, candidate, [too_fast])
    assert found is not None and found.duration >= known.duration
