"""Cycles of least mechanical work: exact energies, a kept cycle time, and a valid bound."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from joulepath import CycleSolution, CycleTooShort, Problem, Stop, optimize, plan_cycle
from joulepath.optimizer.bounds.mechanical_bound import mechanical_bounds
from joulepath.optimizer.bounds.priced_work import PRICED_WORK, priced_work_bounds
from joulepath.optimizer.cycle.stop_layers import layers_of
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import MethodName
from tests.optimizer.cycle.cycles import HOME, pick_and_place
from tests.optimizer.moves import ROBOT
from tests.refusals import refusal_of
from tests.selection import long_but

ROUNDING = 1e-9
# relative: two searches stop at slightly different optima
CONVERGED = 5e-3
# s: well above the shortest cycle, and twice as long
TIME = 6.0
ASKED = pick_and_place(1, 2, windings=False, objective="mechanical", duration_max=TIME)


@cache
def found(time: float, method: MethodName = "bspline") -> CycleSolution:
    return plan_cycle(replace(ASKED, duration_max=time, method=method))


@pytest.mark.parametrize(
    ("time", "method"),
    long_but([(TIME, "time_scaling")], product((TIME, 2 * TIME), ("time_scaling", "bspline"))),
)
def test_the_cycle_is_true(time: float, method: MethodName) -> None:
    round_ = found(time, method)
    assert all(move.solution.certificate.valid for move in round_.moves)
    assert round_.duration == pytest.approx(time) and round_.joins < ROUNDING
    work = round_.energy.mechanical.total
    assert work == pytest.approx(
        sum(move.solution.energy.mechanical.total for move in round_.moves), rel=ROUNDING
    )
    assert 0 < round_.lower_bound <= work and round_.price_of_time >= 0
    # dwells and waits are in the electrical energy, though they are no work
    resting = sum(move.dwell_energy + move.wait_energy for move in round_.moves)
    moving = sum(move.solution.energy.electrical.total for move in round_.moves)
    assert round_.energy.electrical.total == pytest.approx(moving + resting, rel=ROUNDING)
    assert round_.energy.electrical.dwell == pytest.approx(resting, rel=ROUNDING) and resting > 0
    names = {each.name: each for each in round_.baselines}
    assert {"same_factor", "fastest_then_wait"} <= set(names)
    for each in names.values():
        assert each.saving_interval is None
        if not each.within_limits:
            assert each.saving is None
            continue
        assert each.saving == pytest.approx(1 - work / each.mechanical)
        if each.duration == pytest.approx(time):
            assert each.saving >= -CONVERGED


@pytest.mark.long
def test_a_single_move_uses_all_of_the_time() -> None:
    """It does no more work than the same motion by itself."""
    goal = HOME + np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    asked = replace(
        ASKED,
        stops=[Stop(name="goal", target=goal)],
        closed=False,
        duration_max=4.0,
        method="time_scaling",
        with_baselines=False,
    )
    alone = optimize(
        Problem(
            arm=ASKED.arm,
            start=HOME,
            goal=goal,
            windings=False,
            objective="mechanical",
            duration_max=4.0,
            method="time_scaling",
        )
    )
    work = alone.energy.mechanical.total
    assert plan_cycle(asked).energy.mechanical.total <= work * (1 + CONVERGED)


def test_no_random_cycle_gets_below_the_bound() -> None:
    """The bound is below random chains with an even pace in random shares of the time."""
    rng, layers, bound = (
        np.random.default_rng(0),
        list(layers_of(ASKED).values()),
        found(TIME, "time_scaling").lower_bound,
    )
    plants = [
        PreparedProblem.of(Problem(arm=move.arm, start=HOME, goal=HOME)) for move in ASKED.moves
    ]
    for _ in range(40):
        chain = [HOME, *(layer.q[rng.integers(len(layer.q))] for layer in layers[1:]), HOME]
        shares = rng.dirichlet(np.full(3, 3.0)) * (TIME - ASKED.dwell_time)
        motions = [
            quintic_spline(a, b, t) for (a, b), t in zip(pairwise(chain), shares, strict=True)
        ]
        work = sum(
            plant.energy(each).mechanical.total for plant, each in zip(plants, motions, strict=True)
        )
        assert bound <= work


@pytest.mark.long
def test_what_the_price_bounds_holds_for_every_duration() -> None:
    """The bound with a price holds for every duration; without a price, for the longest one."""
    rng, own = np.random.default_rng(1), ROBOT.limits
    prepared = PreparedProblem.of(
        Problem(arm=ASKED.arm, start=HOME, goal=HOME, objective="mechanical", duration_max=5.0)
    )
    start = rng.uniform(own.q_min / 2, own.q_max / 2, (30, 6))
    goal = start + rng.uniform(-3.0, 3.0, (30, 6))
    levels = np.array(
        [[prepared.potential(q) for q in both] for both in zip(start, goal, strict=True)]
    )
    free = priced_work_bounds(prepared, start, goal, levels, 0.0, 5.0)
    exact = mechanical_bounds(prepared, start, goal, levels)
    assert free == pytest.approx(exact, rel=ROUNDING)
    shortest = shortest_duration(goal - start, own)
    for price in (0.5, 5.0, 50.0):
        bound = priced_work_bounds(prepared, start, goal, levels, price, 5.0)
        assert (bound >= free - ROUNDING).all() and (bound >= price * shortest - ROUNDING).all()
        for k in range(30):
            for duration in np.geomspace(shortest[k], 5.0, PRICED_WORK.cells):
                work = prepared.energy(quintic_spline(start[k], goal[k], duration)).mechanical.total
                assert bound[k] <= work + price * duration


def test_it_needs_a_time_and_rests() -> None:
    with refusal_of("time", match="time"):
        replace(ASKED, duration_max=None)
    passing = replace(ASKED.stops[0], dwell=0.0, payload=None, via=True)
    with refusal_of("stops.0.via"):
        replace(ASKED, stops=[passing, ASKED.stops[1]])
    with pytest.raises(CycleTooShort):
        plan_cycle(replace(ASKED, duration_max=ASKED.dwell_time + 0.2))
