"""The interior-point method of least work: derivatives, limits, and comparison with the SQP."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.refined_work import refine_work
from joulepath.optimizer.solve.nlp.interior_point import InteriorPoint
from tests.optimizer.moves import GOAL, START, fixed, limits, problem

# duration of the motions [s]
DURATION = 2.0
# wide and narrow corners [W]
WIDE = 0.5
WIDTH = 0.1
SPACE = bspline.uniform(24)
ENDS = np.array([START, GOAL])
# step of control points in central differences [rad]
EPS = 1e-6
# tolerances relative to the largest entry
GRADIENT_TOLERANCE = 1e-6
HESSIAN_TOLERANCE = 1e-5


@pytest.fixture(name="prepared")
def fixture_prepared() -> PreparedProblem:
    return PreparedProblem.of(problem(objective="mechanical", **fixed(DURATION)))


def program(prepared: PreparedProblem, **given: float) -> InteriorPoint:
    parameters = partial(prepared.parameters, 0.0, 1.0, 0.0, None)
    plain = prepared.frictionless_parameters
    return InteriorPoint(prepared.kernel, SPACE, limits(**given), DURATION, parameters, plain)


def line() -> Array:
    return np.asarray(START + np.outer(SPACE.quintic, GOAL - START)[SPACE.free])


def crooked() -> Array:
    return line() + np.random.default_rng(0).normal(scale=0.05, size=line().shape)


def test_ratios_change_as_their_linearisation_says(prepared: PreparedProblem) -> None:
    own, free = program(prepared, tau_max=20.0), crooked()
    bounds = own.unbounded()
    at = own.first(ENDS, free, WIDTH, bounds)
    nodes, change = own._nodes(ENDS, at), np.random.default_rng(1).normal(size=free.shape)

    def ratio(step: float) -> Array:
        return own._nodes(ENDS, own.first(ENDS, free + step * change, WIDTH, bounds)).ratio

    difference = (ratio(EPS) - ratio(-EPS)) / (2 * EPS)
    by_state = (own._D @ change).reshape(len(nodes.power), -1, 1)
    predicted = own._change(change, (nodes.torque_jacobian @ by_state)[:, :, 0])
    assert predicted == pytest.approx(difference, abs=GRADIENT_TOLERANCE * np.abs(difference).max())
    # the pull on the variables is the transpose of this map
    weight = np.random.default_rng(2).normal(size=len(predicted))
    assert float((own._pulled(nodes, weight) * change).sum()) == pytest.approx(
        float(weight @ predicted), rel=1e-9
    )


def test_hessian_is_that_of_the_lagrangian(prepared: PreparedProblem) -> None:
    """With slopes held, Σ weight u p + price · torque has the Hessian at the nodes."""
    own, free = program(prepared, tau_max=20.0), crooked()
    bounds = own.unbounded()
    at = own.first(ENDS, free, WIDTH, bounds)
    price = at.price.copy()
    at, change = replace(at, price=price), np.random.default_rng(1).normal(size=free.shape)
    pull = own._torque_part(price[0] - price[1]) / own.limits.tau_max

    def gradient(step: float) -> Array:
        moved = own.first(ENDS, free + step * change, WIDTH, bounds)
        nodes = own._nodes(ENDS, moved)
        by_power = ((own._weights[:, None] * at.slope)[:, None] @ nodes.jacobian).reshape(
            -1, own._r
        )
        by_torque = (pull[:, None] @ nodes.torque_jacobian).reshape(-1, own._r)
        return np.asarray(own._D.T @ (by_power + by_torque))

    difference = (gradient(EPS) - gradient(-EPS)) / (2 * EPS)
    by_state = (own._D @ change).reshape(len(SPACE.nodes), -1, 1)
    product = own._D.T @ (own._nodes(ENDS, at).hessian @ by_state).reshape(-1, own._r)
    assert product == pytest.approx(difference, abs=HESSIAN_TOLERANCE * np.abs(difference).max())


@pytest.mark.parametrize("given", [{}, {"v_max": 1.1}])
def test_work_falls_within_the_limits(prepared: PreparedProblem, given: dict[str, float]) -> None:
    """From a motion with wide corners, as in a search."""
    own = program(prepared, **given)
    bounds = own.unbounded()
    wide = own.minimised(ENDS, own.first(ENDS, line(), WIDE, bounds), WIDE, bounds, 1e-3)
    first = own.first(ENDS, wide.free, WIDE, bounds)
    found = own.minimised(ENDS, first, SMOOTHING.sharper_power_widths[-1], bounds, 2e-4)
    assert found.converged and found.work < first.work
    spline = spline_of(SPACE, own.points(ENDS, found.free), DURATION)
    # between the points, a rate exceeds its limit by little
    assert (peak_rates(spline) <= 1.02 * own.limits.rates).all()
    assert (found.slack > 0).all() and (np.abs(found.slope) <= 1).all()
    again = own.minimised(
        ENDS, first, SMOOTHING.sharper_power_widths[-1], bounds, 2e-4, below=0.5 * found.work
    )
    assert again.costlier and again.iterations < found.iterations


def test_bounds_are_tightened_per_span(prepared: PreparedProblem) -> None:
    own = program(prepared)
    spans = np.ones((3, len(np.unique(SPACE.knots)) - 1, len(START)))
    spans[2, 4, 1] = 0.9
    tightened = own.tightened(own.unbounded(), spans, np.ones(len(START)))
    at = own._rate_places[2] * spans.shape[1]
    jerk = own._rate_part(tightened)[-len(at) :, 1]
    assert (jerk == np.where((at > 4 - 1e-9) & (at < 5 + 1e-9), 0.9, 1.0)).all()
    assert (tightened < 1).sum() == (jerk < 1).sum()


def test_a_refined_motion_is_within_every_limit(prepared: PreparedProblem) -> None:
    points = START + np.outer(bspline.uniform(40).quintic, GOAL - START)
    result, own = refine_work(prepared, points, DURATION, WIDTH)
    assert result.spline is not None
    assert (peak_rates(result.spline) <= prepared.problem.arm.active_limits.rates).all()
    assert own == pytest.approx(result.spline.control_points)
    costlier, _ = refine_work(
        prepared, points, DURATION, WIDTH, 0.5 * prepared.cost_of(result.spline)
    )
    assert costlier.spline is None
