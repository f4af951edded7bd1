"""Rough motions, many at a time: derivatives against differences, and energies against those of the
SQP.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import WIDTH
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.many_motions import ManyMotions
from tests.optimizer.moves import GOAL, START, fixed, limits, problem

DURATION = 2.0
STEP = 1e-6  # of control points [rad]
# relative to the largest entry: a central difference loses STEP² of the third derivative, and
# rounding over STEP
FIRST, SECOND = 1e-6, 1e-5
# shares by which a limit is exceeded where a penalty holds it
EXCEEDED = 0.1
SPACE = bspline.uniform(13)


def motions(**given: float) -> ManyMotions:
    arm_limits = limits(**given)
    prepared = PreparedProblem.of(problem(objective="mechanical", **fixed(DURATION)))
    p = prepared.parameters(mechanical=1.0, width=WIDTH)
    return ManyMotions(prepared.kernel, SPACE, arm_limits, DURATION, p)


def guesses(count: int) -> tuple[Array, Array]:
    """Ends (B, 2, nq) and free control points (B, m, nq) of motions that are neither straight nor
    alike.
    """
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
        slope = (total(moved(k, STEP)) - total(moved(k, -STEP))) / (2 * STEP)
        assert gradient[:, k] == pytest.approx(slope, abs=FIRST * np.abs(gradient).max())
        bends = (slopes(moved(k, STEP)) - slopes(moved(k, -STEP)))[:, k : k + band.shape[2]] / (
            2 * STEP
        )
        # of penalties, what their squares' curvature times their excess adds is left out: rates are
        # linear
        relative = SECOND if not given else 0.05
        assert band[:, k, : bends.shape[1]] == pytest.approx(
            bends, abs=relative * np.abs(band).max()
        )


def test_costs_fall_and_limits_are_kept() -> None:
    own, (ends, free) = motions(v_max=0.8), guesses(3)
    before = sum(own._value(ends, free, np.ones(3))[:2])
    found = own.minimised(ends, free, 1e-3)
    assert (found.cost + found.penalty < before).all()
    points = own.points(ends, found.free)
    for each in points:
        spline = spline_of(SPACE, each, DURATION)
        assert (peak_rates(spline) <= own.limits.rates * (1 + EXCEEDED)).all()
        assert spline.control_points[[0, -1]] == pytest.approx(np.array([START, GOAL]))
    assert found.cost == pytest.approx(own.costs(points, own.p))


def test_motions_are_solved_as_if_alone() -> None:
    own, (ends, free) = motions(), guesses(3)
    together = own.minimised(ends, free, 1e-2)
    for k in range(3):
        alone = own.minimised(ends[k : k + 1], free[k : k + 1], 1e-2)
        # rounding of sums in another order, amplified along the way
        assert alone.cost == pytest.approx(together.cost[k : k + 1], rel=1e-2)
