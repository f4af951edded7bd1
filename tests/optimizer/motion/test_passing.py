"""When a motion passes configurations, and motions joined at rest."""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.joined import joined
from joulepath.optimizer.motion.passing import deviations, pass_times
from joulepath.optimizer.motion.spline import Spline, peak_rates, sample, spline_of
from joulepath.optimizer.motion.time_scalings import quintic_spline

ROUNDING = 1e-12


def wavy(seed: int) -> Spline:
    rng, space = np.random.default_rng(seed), bspline.uniform(16)
    points = np.outer(space.quintic, np.ones(6))
    points[space.free] += 0.4 * rng.normal(size=(10, 6))
    return spline_of(space, points, 3.0)


def test_times_of_points_on_a_curve_are_found() -> None:
    for seed in range(20):
        curve, rng = wavy(seed).curve, np.random.default_rng(seed)
        t = np.sort(rng.uniform(0.3, 2.7, 4))
        assert np.abs(pass_times(curve, curve(t)) - t).max() < 1e-6
        assert deviations(curve, curve(t)).max() < 1e-9


def test_passes_are_met_in_their_order() -> None:
    """A motion there and back passes a configuration twice: after the turn, the pass on the way
    back is found.
    """
    there = quintic_spline(np.zeros(6), np.ones(6), 1.0)
    back = quintic_spline(np.ones(6), np.zeros(6), 1.0)
    motion, half = joined([there, back]), np.full(6, 0.5)
    once, turn, again = pass_times(motion.curve, np.array([half, np.ones(6), half]))
    assert abs(once - 0.5) < 1e-6 and abs(turn - 1.0) < 1e-2 and abs(again - 1.5) < 1e-6


def test_a_point_beside_the_curve_is_missed_by_its_distance() -> None:
    """Nearest in the sum of squares, against the minimum of a fine search."""
    curve = wavy(1).curve
    beside = curve(1.2) + np.array([0, 0.05, 0, -0.05, 0.02, 0])
    t = np.linspace(0, 3, 30001)
    nearest = np.linalg.norm(curve(t) - beside, axis=1).min()
    found = pass_times(curve, beside[None])
    assert abs(np.linalg.norm(curve(found[0]) - beside) - nearest) < 1e-6
    assert deviations(curve, beside[None])[0] <= nearest


def test_joined_motions_are_each_as_before() -> None:
    first, second = wavy(2), wavy(3)
    shift = Spline(
        5,
        second.knots,
        second.control_points + (first.control_points[-1] - second.control_points[0]),
    )
    whole = joined([first, shift, shift_to(shift.control_points[-1])])
    assert abs(whole.duration - 9.0) < ROUNDING
    t = np.linspace(0.01, 2.99, 50)
    for own, begin in ((first, 0.0), (shift, 3.0)):
        for ours, theirs in zip(sample(whole, begin + t), sample(own, t), strict=True):
            assert np.abs(ours - theirs).max() < 1e-9
    assert np.allclose(
        peak_rates(whole).max(axis=1),
        peak_rates(joined([first, shift]))
        .max(axis=1)
        .clip(peak_rates(shift_to(shift.control_points[-1])).max(axis=1)),
    )


def shift_to(q: np.ndarray) -> Spline:
    last = wavy(4)
    return Spline(5, last.knots, last.control_points + (q - last.control_points[0]))
