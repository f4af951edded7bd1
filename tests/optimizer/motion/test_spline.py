"""Splines in time: durations and rates are met exactly; quadrature over the knots."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.optimizer.motion.quadrature import lobatto_nodes, lobatto_panels
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.spline import (
    lasting,
    least_time_scale,
    peak_rates,
    resting_until,
    retimed,
    time_scale,
    time_scales,
)
from tests.optimizer.moves import GOAL, ROBOT, START, limits

MOTION = time_optimal_spline(ROBOT.limits, START, GOAL)
ROUNDING = 1e-12
# accelerations, divided differences of positions over spans of some milliseconds [rad/s²]
OF_RATES = 1e-9
# relative; peaks of the jerk between samples, in spans other than a quintic at rest
PEAK = 1e-6


@pytest.mark.parametrize("duration", [0.3, 1.0, MOTION.duration, 7.1])
def test_a_duration_is_met_exactly(duration: float) -> None:
    slower = lasting(MOTION, duration)
    assert slower.duration == duration
    t = np.linspace(0.0, 1.0, 50)
    assert slower.curve(t * duration) == pytest.approx(
        MOTION.curve(t * MOTION.duration), abs=ROUNDING
    )


def test_rates_fall_with_powers_of_the_factor() -> None:
    expected = peak_rates(MOTION) / np.array([2.0, 4.0, 8.0])[:, None]
    assert peak_rates(retimed(MOTION, 2.0)) == pytest.approx(expected, rel=PEAK)


def test_a_motion_rests_at_its_goal_until_a_time() -> None:
    longer = resting_until(MOTION, MOTION.duration + 3.0)
    assert longer.duration == MOTION.duration + 3.0
    moving = np.linspace(0.0, MOTION.duration, 50)
    for derivative in range(3):
        expected = MOTION.curve(moving, derivative)
        assert longer.curve(moving, derivative) == pytest.approx(expected, abs=OF_RATES)
    resting = np.linspace(MOTION.duration, longer.duration, 20)
    assert np.abs(longer.curve(resting) - MOTION.control_points[-1]).max() < ROUNDING
    assert peak_rates(longer) == pytest.approx(peak_rates(MOTION), rel=PEAK)


@pytest.mark.parametrize("given", [{"v_max": 0.5}, {"a_max": 1.0}, {"j_max": 5.0}])
def test_the_least_time_scale_brings_one_rate_to_its_limit(given: dict[str, float]) -> None:
    own = limits(**given)
    slower = retimed(MOTION, least_time_scale(MOTION, own.rates))
    assert (peak_rates(slower) / own.rates).max() == pytest.approx(1.0, rel=PEAK)


def test_time_scales_of_several_motions_are_those_of_each() -> None:
    ratios = np.random.default_rng(5).uniform(0.1, 3.0, (4, 3, 6))
    assert time_scales(ratios).tolist() == [time_scale(each) for each in ratios]


OF_SUMS = 1e-14  # relative; sums of some hundred products
BREAKS = np.array([0.3, 0.31, 0.9, 1.7])
PANELS = np.array([1, 7, 2])


@pytest.mark.parametrize("degree", range(10))
def test_polynomials_up_to_degree_nine_are_exact(degree: int) -> None:
    interval, offset, weights = lobatto_panels(BREAKS, PANELS)
    t = BREAKS[interval] + offset
    exact = np.diff(BREAKS ** (degree + 1)) / (degree + 1)
    sums = np.bincount(interval, weights * t**degree)
    assert sums == pytest.approx(exact, rel=10 * OF_SUMS)


def test_intervals_begin_and_end_with_a_node() -> None:
    interval, offset, weights = lobatto_panels(BREAKS, PANELS)
    assert np.bincount(interval).tolist() == (6 * PANELS).tolist()
    for k, length in enumerate(np.diff(BREAKS)):
        inside = offset[interval == k]
        assert inside[0] == 0.0 and inside[-1] == length
        assert (np.diff(inside) > -OF_SUMS).all()
    assert weights.sum() == pytest.approx(BREAKS[-1] - BREAKS[0], rel=OF_SUMS)


def test_nodes_over_the_unit_interval_end_exactly() -> None:
    tau, weights = lobatto_nodes(np.array([0.0, 0.2, 0.55, 1.0]))
    assert tau[0] == 0.0 and tau[-1] == 1.0
    assert weights.sum() == pytest.approx(1.0, rel=OF_SUMS)
