"""Knots of slow motions: at the ramps, in spans that grow from there, and refined into spaces that
hold the first.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.ramp_knots import RampKnots
from tests.optimizer.moves import limits

RAMPS = RampKnots()
ROUNDING = 1e-12
# relative; interpolation at some fifty points, next to knots a ten-thousandth apart
REFIT = 1e-7
COUNT = 13


def switches(duration: float, speed: float = 0.1) -> np.ndarray:
    """Of a joint that travels 2 rad."""
    way = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    return seven_segment.switches(way, duration, limits(v_max=speed), RAMPS.closest_switches)


@pytest.mark.parametrize("repeat", [1, 2, 3])
@pytest.mark.parametrize("duration", [20.1, 60.0, 600.0])
def test_spans_grow_from_the_ramps(duration: float, repeat: int) -> None:
    """None is more than three times its neighbour, or wider than those of evenly spaced knots."""
    space = RAMPS.space(switches(duration), repeat, COUNT)
    breaks, counts = np.unique(space.knots, return_counts=True)
    lengths = np.diff(breaks)
    ratios = lengths[1:] / lengths[:-1]
    between = (breaks[1:-1] > 0.02) & (breaks[1:-1] < 0.98)
    assert max(ratios[between].max(), 1 / ratios[between].min()) <= RAMPS.growth * (1 + ROUNDING)
    assert lengths.max() <= 1 / (COUNT - bspline.DEGREE) + ROUNDING
    assert lengths.min() >= RAMPS.shortest_end_span / 10
    assert (counts[1:-1] == repeat).sum() >= 2
    assert np.allclose(breaks, 1 - breaks[::-1], atol=ROUNDING)


def test_no_ramp_is_too_short_for_a_knot() -> None:
    """Of ten minutes, a ramp of a hundredth of a second: there is a knot at the finest distance."""
    breaks = np.unique(RAMPS.space(np.array([2e-6, 1 - 2e-6]), 3, COUNT).knots)
    assert breaks[1] == RAMPS.shortest_end_span and breaks[-2] == 1 - RAMPS.shortest_end_span


@pytest.mark.parametrize("repeat", [2, 3])
def test_a_refined_space_holds_every_motion_of_the_first(repeat: int) -> None:
    at = switches(20.1)
    first = RAMPS.space(at, 1, COUNT)
    # the motion that was found may last a little longer
    finer = RAMPS.refined(first.knots, np.where(at < 0.5, 0.99 * at, 1 - 0.99 * (1 - at)), repeat)
    points = np.random.default_rng(0).uniform(-1, 1, (first.n, 2))
    again = bspline.refit(points, first.knots, finer.knots)
    x = np.linspace(0, 1, 4001)
    assert np.allclose(finer.matrix(x) @ again, first.matrix(x) @ points, atol=REFIT)
    breaks, counts = np.unique(finer.knots, return_counts=True)
    assert np.diff(breaks).max() <= RAMPS.widest_refined_span + ROUNDING
    assert (counts[1:-1] == repeat).sum() == len(at)


@pytest.mark.parametrize(("speed", "slow"), [(3.0, False), (0.25, True), (0.02, True)])
def test_what_is_slow_depends_on_ramp_and_duration(speed: float, slow: bool) -> None:
    way = np.full(6, 2.0)
    own = limits(v_max=speed)
    ramp, shortest = seven_segment.ramp(way, own), float(seven_segment.shortest_duration(way, own))
    assert RAMPS.is_slow(ramp, shortest) is slow
    assert RAMPS.is_slow(ramp, 1000.0)


def test_the_ramp_is_that_of_the_leading_joint() -> None:
    """Speed over acceleration, and acceleration over jerk; of a short way, half of the time."""
    own = limits(v_max=1.0, a_max=[1, 2, 4, 5, 8, 10], j_max=20.0)
    assert seven_segment.ramp(np.array([0, 0, 3.0, 0, 0, 0.1]), own) == pytest.approx(
        1 / 4 + 4 / 20
    )
    short = np.full(6, 1e-3)
    half = float(seven_segment.shortest_duration(short, own)) / 2
    assert seven_segment.ramp(short, own) == pytest.approx(half)
    assert seven_segment.ramp(np.zeros(6), own) == 0
