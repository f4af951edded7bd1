"""Lower bounds over the duration, and as displacement and limits change."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from joulepath.optimizer.bounds.lower_bound import lower_bounds, priced_bounds
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from tests.optimizer.bounds.test_lower_bound import CONDITIONS, EXACT, Torques, bound, ends
from tests.optimizer.moves import PAYLOAD, ROBOT, fixed, limits, problem
from tests.selection import long_but


@pytest.mark.parametrize(
    ("name", "pairs"),
    long_but(
        (("as it comes", 2), ("wide reversal", 2)),
        product(("as it comes", "hardly idle", "wide reversal"), (2, 4)),
    ),
)
def test_the_bound_is_the_least_over_the_duration(name: str, pairs: int) -> None:
    """Against bounds at two thousand fixed durations: none is lower, and the least of them is as
    low.
    """
    torques = Torques(problem(**CONDITIONS[name]))
    start, goal = ends(7, pairs)
    free, shortest = bound(torques, start, goal)
    for k in range(pairs):
        times = np.geomspace(shortest[k], DURATIONS.longest, 2000)
        each = [bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0] for T in times[::20]]
        assert free[k] <= min(each) * (1 + EXACT)
        low = max(int(np.argmin(each)) - 1, 0) * 20
        fine = [
            bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0]
            for T in times[low : low + 41]
        ]
        assert free[k] == pytest.approx(min(fine), rel=1e-4)  # between two of the durations


@pytest.mark.parametrize("price", long_but([100.0], [-40.0, -36.0, -30.0, 100.0]))
def test_the_bound_at_a_price_of_time_is_the_least_over_the_duration(price: float) -> None:
    """Slow ways pay where time is cheap, the slowest where it is paid for."""
    torques, longest = Torques(problem(payload=PAYLOAD)), 90.0
    start, goal = ends(9, 3)
    gain = np.array(
        [
            torques.task.potential(b) - torques.task.potential(a)
            for a, b in zip(start, goal, strict=True)
        ]
    )
    priced = priced_bounds(torques.task, goal - start, gain, price, longest)
    for k in range(3):
        times = np.geomspace(
            float(shortest_duration(goal[k] - start[k], ROBOT.limits)), longest, 400
        )
        each = [
            bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0] + price * T
            for T in times
        ]
        assert priced[k] <= min(each) + EXACT * abs(min(each))
        assert priced[k] == pytest.approx(min(each), rel=2e-3)


def test_duration_bounds_raise_the_bound() -> None:
    """To the convex function's value at the nearer end of the interval, or to infinity where no
    motion is that fast.
    """
    torques = Torques(problem())
    start, goal = ends(8)
    free, shortest = bound(torques, start, goal)
    longer, _ = bound(torques, start, goal, duration_min=12.0)
    assert (longer >= free * (1 - EXACT)).all()
    assert longer == pytest.approx(
        bound(torques, start, goal, **fixed(12.0))[0], rel=1e-6
    )  # all would be faster
    limit = float(np.median(shortest))
    capped, _ = bound(torques, start, goal, duration_max=limit)
    assert (np.isinf(capped) == (shortest > limit)).all()
    assert (capped >= free * (1 - EXACT)).all()


def test_longer_travel_never_lowers_the_bound() -> None:
    """Joint by joint, with potential_gain as it is; the least duration grows as well."""
    rng = np.random.default_rng(9)
    for name, conditions in CONDITIONS.items():
        if name == "wide reversal":
            continue  # its deficit grows with the time, not with the displacement
        task = PreparedProblem.of(problem(**conditions))
        displacement, potential_gain = (
            rng.normal(size=(300, 6)) * 10 ** rng.uniform(-2, 0.3, (300, 1)),
            rng.normal(size=300),
        )
        longer = displacement.copy()
        joint = rng.integers(0, 6, 300)
        longer[np.arange(300), joint] *= rng.uniform(1.0, 2.0, 300)
        (low, least), (high, more) = (
            lower_bounds(task, displacement, potential_gain),
            lower_bounds(task, longer, potential_gain),
        )
        assert (more >= least * (1 - EXACT)).all()
        assert (high >= low - EXACT * np.abs(low)).all()


def test_tighter_limits_never_lower_the_bound() -> None:
    start, goal = ends(10)
    tolerance, _ = bound(Torques(problem()), start, goal)
    for tight in (
        limits(v_max=0.5),
        limits(a_max=2.0),
        limits(j_max=20.0),
        limits(tau_max=[80, 120, 80, 9, 9, 9]),
    ):
        ours, _ = bound(Torques(problem(limits=tight)), start, goal)
        assert (ours >= tolerance * (1 - EXACT)).all()


def test_mechanical_bound_is_the_climb() -> None:
    """By hand: 2 kg on the flange lifted with the arm; the work against gravity is the least, up or
    down.
    """
    task = PreparedProblem.of(problem(objective="mechanical", duration_max=5.0))
    ours, _ = lower_bounds(task, np.ones((2, 6)), np.array([12.0, -7.0]))
    assert ours.tolist() == [12.0, 7.0]
