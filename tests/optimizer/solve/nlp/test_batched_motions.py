"""Coarse solves of a batch of motions: derivatives, costs, limits, and independence."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.batched_motions import BatchedMotions
from tests.optimizer.moves import GOAL, START, fixed, limits, problem

DURATION = 2.0
# step of control points in central differences [rad]
EPS = 1e-6
# tolerances relative to the largest entry: a central difference has the error step² of the third
# derivative, and rounding / step
GRADIENT_TOLERANCE = 1e-6
HESSIAN_TOLERANCE = 1e-5
# relative excess over a limit at which its penalty is in balance
ALLOWED_EXCESS = 0.1
SPACE = bspline.uniform(13)


def motions(**given: float) -> BatchedMotions:
    arm_limits = limits(**given)
    prepared = PreparedProblem.of(problem(objective="mechanical", **fixed(DURATION)))
    p = prepared.parameters(mechanical=1.0, width=SMOOTHING.power_width)
    return BatchedMotions(prepared.kernel, SPACE, arm_limits, DURATION, p)


def guesses(count: int) -> tuple[Array, Array]:
    """Ends (B, 2, nq) and free control points (B, m, nq) of different, curved motions."""
    rng = np.random.default_rng(0)
    ends = np.array([[START, GOAL]] * count)
    line = START + np.outer(SPACE.quintic, GOAL - START)[SPACE.free]
    return ends, line + rng.normal(scale=0.1, size=(count, *line.shape))


# with low limits, penalties of rates and of torques count
@pytest.mark.parametrize("given", [{}, {"v_max": 0.3, "tau_max": 20.0, "q_max": 1.0}])
def test_derivatives(given: dict[str, float]) -> None:
    own, (ends, free) = motions(**given), guesses(2)
    scale = np.array([1.0, 2.0])
    gradient, band = own._derivatives(ends, free, scale, own._value(ends, free, scale)[2])

    def moved(k: int, step: float) -> Array:
        changed = free.reshape(2, -1).copy()
        changed[:, k] += step
        return changed.reshape(free.shape)

    def total(at: Array) -> Array:
        cost, penalty, _ = own._value(ends, at, scale)
        return cost + penalty

    def slopes(at: Array) -> Array:
        return own._derivatives(ends, at, scale, own._value(ends, at, scale)[2])[0]

    for k in range(0, gradient.shape[1], 7):
        slope = (total(moved(k, EPS)) - total(moved(k, -EPS))) / (2 * EPS)
        assert gradient[:, k] == pytest.approx(
            slope, abs=GRADIENT_TOLERANCE * np.abs(gradient).max()
        )
        columns = (slopes(moved(k, EPS)) - slopes(moved(k, -EPS)))[:, k : k + band.shape[2]] / (
            2 * EPS
        )
        # the Hessian leaves out the curvature of torques in the penalty
        relative = HESSIAN_TOLERANCE if not given else 0.05
        assert band[:, k, : columns.shape[1]] == pytest.approx(
            columns, abs=relative * np.abs(band).max()
        )


def test_costs_fall_and_limits_are_kept() -> None:
    own, (ends, free) = motions(v_max=0.8), guesses(3)
    before = sum(own._value(ends, free, np.ones(3))[:2])
    found = own.minimised(ends, free, 1e-3)
    assert (found.cost + found.penalty < before).all()
    points = own.points(ends, found.free)
    for each in points:
        spline = spline_of(SPACE, each, DURATION)
        assert (peak_rates(spline) <= own.limits.rates * (1 + ALLOWED_EXCESS)).all()
        assert spline.control_points[[0, -1]] == pytest.approx(np.array([START, GOAL]))
    assert found.cost == pytest.approx(own.costs(points, own.p))


def test_motions_are_solved_as_if_alone() -> None:
    own, (ends, free) = motions(), guesses(3)
    together = own.minimised(ends, free, 1e-2)
    for k in range(3):
        alone = own.minimised(ends[k : k + 1], free[k : k + 1], 1e-2)
        # rounding of sums in another order is amplified by the iteration
        assert alone.cost == pytest.approx(together.cost[k : k + 1], rel=1e-2)
