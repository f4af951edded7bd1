"""Cycles in a given time: the time is met, shared at one price, and never dearer than sharing it in
simple ways.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    BranchFilter,
    Cycle,
    CycleSolution,
    CycleTooShort,
    DeadlineExceeded,
    InvalidProblem,
    JoulepathError,
    NoTrajectory,
    Problem,
    Stop,
    optimize,
    plan_cycle,
)
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.pair_solver import PairSolver
from joulepath.optimizer.cycle.stop_layers import layers_of
from joulepath.optimizer.cycle.time_allocation import TimeAllocation, total_duration
from joulepath.optimizer.cycle.timed_bound import TIMED_BOUND, TimedBound
from joulepath.optimizer.cycle.timed_cycle import TimedSearch
from joulepath.optimizer.dynamics.dwell import holding_power
from tests.optimizer.clocks import still
from tests.optimizer.cycle.cycles import HOME, pick_and_place
from tests.optimizer.cycle.test_optimize_cycle import assert_true, planned
from tests.optimizer.moves import AMPLE, ROBOT, fixed, torques
from tests.refusals import refusal_of
from tests.selection import long_but

ROUNDING = 1e-9
# rad
TURN = np.array([0.9, -0.3, 0.2, 0.0, 0.1, 0.4])
# relative: an optimum found from another guess
CONVERGED = 2e-3
# of the cycle's own duration; and between the shortest one and this
LONGER = 1.2
SHORTER = 0.5
ASKED = pick_and_place(1, 2, windings=False)


@cache
def free() -> CycleSolution:
    """The cycle of least energy in free time."""
    return plan_cycle(ASKED)


@cache
def shortest() -> float:
    """Duration [s] of the fastest cycle, from the error for a faster request."""
    with pytest.raises(CycleTooShort) as refusal:
        plan_cycle(in_time(ASKED, 0.3 * free().duration))
    return refusal.value.shortest


def in_time(asked: Cycle, duration: float) -> Cycle:
    return replace(asked, duration_min=duration, duration_max=duration)


def duration_of(factor: float) -> float:
    """A duration [s]: `factor` times the free cycle's, or for factors below 1, a point in between.

    The point divides the range from the shortest duration to the free one by `factor`.
    """
    return (
        factor * free().duration
        if factor >= 1
        else shortest() + factor * (free().duration - shortest())
    )


@cache
def timed(factor: float) -> CycleSolution:
    """The cycle in `duration_of` the factor."""
    return plan_cycle(in_time(ASKED, duration_of(factor)))


FACTORS = long_but([1.3], [0.05, 0.4, 0.8, 1.02, 1.3, 2.0, 3.0, 10.0, 30.0])


@pytest.mark.parametrize("factor", FACTORS)
def test_the_time_is_met_and_the_cycle_true(factor: float) -> None:
    found, duration = timed(factor), duration_of(factor)
    assert_true(in_time(ASKED, duration), found)
    assert found.duration == pytest.approx(duration, rel=1e-9)
    assert found.energy.electrical.total >= free().energy.electrical.total * (1 - CONVERGED)
    assert found.lower_bound >= free().lower_bound * (1 - ROUNDING)
    assert sum(move.wait > 0 for move in found.moves) <= 1
    assert found.price_of_time <= 0 if factor > 1 else found.price_of_time >= 0


@pytest.mark.parametrize("factor", FACTORS)
def test_it_is_not_dearer_than_simple_ways_to_share_the_time(factor: float) -> None:
    names = {each.name: each for each in timed(factor).baselines}
    assert "fastest_then_wait" in names
    for name in ("fastest_then_wait", "same_factor"):
        if name in names and names[name].within_limits:
            assert names[name].saving >= -CONVERGED


@pytest.mark.long
def test_no_other_way_to_share_the_time_is_cheaper() -> None:
    """No other allocation of the time to the moves of the chain needs less energy.

    A grid of durations covers all shares; `optimize` solves every move at every duration.
    """
    found = timed(1.3)
    total = sum(move.solution.duration + move.wait for move in found.moves)
    ends = [(move.planned.arm, move.solution.start.q, move.solution.goal.q) for move in found.moves]
    own = [move.solution.duration for move in found.moves]
    moving = found.energy.electrical.total - sum(move.dwell_energy for move in found.moves)

    @cache
    def energy(k: int, duration: float) -> float:
        arm, q_start, q_goal = ends[k]
        task = Problem(
            arm=arm, start=q_start, goal=q_goal, windings=False, deadline=AMPLE, **fixed(duration)
        )
        return optimize(task).energy.electrical.total

    shares = [0.92, 1.0, 1.08]
    for first, second in product(shares, shares):
        durations = [first * own[0], second * own[1]]
        last = total - sum(durations) - sum(move.wait for move in found.moves)
        other = sum(energy(k, round(t, 6)) for k, t in enumerate([*durations, last]))
        other += sum(move.wait_energy for move in found.moves)
        assert moving <= other * (1 + CONVERGED)


@pytest.mark.long
def test_the_price_is_what_a_second_more_would_save() -> None:
    step = 0.02
    before, after = (timed(1.3 + side * step) for side in (-1, 1))
    slope = (before.energy.electrical.total - after.energy.electrical.total) / (
        after.duration - before.duration
    )
    assert timed(1.3).price_of_time == pytest.approx(slope, rel=0.1)
    assert timed(1.3).price_of_time < 0


def test_bounds_on_the_time_leave_a_cycle_alone_that_keeps_them() -> None:
    own = free().duration
    wide = plan_cycle(replace(ASKED, duration_min=0.9 * own, duration_max=1.1 * own))
    assert (
        wide.energy.electrical.total == free().energy.electrical.total and wide.price_of_time == 0
    )


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([0], range(10)))
def test_the_bound_holds_for_every_chain_and_share(seed: int) -> None:
    """Random chains of configurations, in random shares of the time, need at least the bound."""
    asked = pick_and_place(seed, 2, windings=False)
    only = BranchFilter(elbow="up")
    asked = replace(asked, stops=[replace(stop, branch=only, dwell=0.0) for stop in asked.stops])
    duration = 1.4 * plan_cycle(asked).duration
    found = plan_cycle(in_time(asked, duration))
    rng, layers = np.random.default_rng(seed), list(layers_of(asked).values())
    for _ in range(4):
        chain = [HOME, *(layer.q[rng.integers(len(layer.q))] for layer in layers[1:]), HOME]
        shares = np.diff([0.0, *np.sort(rng.uniform(0.2, 0.8, 2)), 1.0]) * duration
        total = 0.0
        for k, share in enumerate(shares):
            given = {"windings": False, "deadline": AMPLE, **fixed(share)}
            try:
                move = optimize(
                    Problem(arm=asked.arms[k], start=chain[k], goal=chain[k + 1], **given)
                )
            except JoulepathError:  # this share is too short: no cycle of this kind
                break
            total += move.energy.electrical.total
        else:
            assert found.lower_bound <= total
            assert found.energy.electrical.total <= total * (1 + CONVERGED)


@pytest.mark.long
@pytest.mark.parametrize(
    "hold",
    [pytest.param({}, marks=pytest.mark.long), {"hold": "brakes", "brake_power": 1.0}],
    ids=str,
)
def test_a_least_time_is_bounded_for_longer_cycles_and_longer_moves_too(
    hold: dict[str, Any],
) -> None:
    """A given least time alone also bounds longer cycles, and moves longer than this time."""
    asked = Cycle(
        arm=ASKED.arm,
        start=HOME,
        stops=[Stop(name="turned", target=HOME + TURN)],
        deadline=AMPLE,
        **hold,
    )
    least = 1.5 * plan_cycle(asked).duration
    bound = plan_cycle(replace(asked, duration_min=least)).lower_bound

    @cache
    def moving(k: int, duration: float) -> float:
        ends = [HOME, HOME + TURN][:: 1 - 2 * k]
        task = Problem(
            arm=asked.arm,
            start=ends[0],
            goal=ends[1],
            windings=False,
            deadline=AMPLE,
            **fixed(duration),
        )
        return optimize(task).energy.electrical.total

    ends, still = np.array([HOME, HOME + TURN]), np.zeros((2, 6))
    tau = torques(Problem(arm=asked.arm, start=HOME, goal=HOME), ends, still, still)
    waiting = 1.0 if hold else float(holding_power(asked.arm, tau).min())
    for durations in product([0.4 * least, 0.7 * least, 1.1 * least, 3.0 * least], repeat=2):
        waited = max(least - sum(durations), 0.0)
        assert bound <= sum(moving(k, t) for k, t in enumerate(durations)) + waiting * waited


def test_the_bound_counts_the_electronics_for_the_whole_time() -> None:
    """No cycle draws less than electronics and inverters do, even if it saves more by slow moves:
    an arm that holds its load at a great loss does so.
    """
    drives = replace(ROBOT.drives, copper=30 * ROBOT.drives.copper)
    asked = Cycle(
        arm=Arm(robot=replace(ROBOT, drives=drives), collisions=False),
        start=HOME,
        stops=[Stop(name="turned", target=HOME + TURN)],
        windings=False,
    )
    drawn, time = asked.arm.base_power + asked.arm.drives.inverter_constant.sum(), 8.0
    bound = TimedBound(asked, CycleSearch(asked, still).legs, time, time)
    assert bound.at(-1.2 * drawn, np.inf) > TIMED_BOUND.second_price * drawn * time


@pytest.mark.parametrize(
    "given",
    [
        {"duration_min": 0.0},
        {"duration_max": np.nan},
        {"duration_max": 1e6},
        {"duration_min": 3.0, "duration_max": 2.0},
    ],
    ids=str,
)
def test_a_wrong_time_names_its_field(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        replace(ASKED, **given)
    assert refusal.value.field.startswith("time")


@pytest.mark.parametrize("place", long_but(["start"], ["start", "stop 1"]))
def test_it_waits_where_it_is_told_to(place: str) -> None:
    asked = in_time(
        replace(ASKED, hold="brakes", brake_power=1.0, wait=place), 2.0 * free().duration
    )
    found = planned(asked)
    assert [move.planned.goal for move in found.moves if move.wait > 0] == [place]


def test_a_place_to_wait_must_be_one() -> None:
    with refusal_of("wait"):
        replace(ASKED, wait="nowhere")


@pytest.mark.long
def test_the_fastest_cycle_is_no_slower_than_ours_at_full_speed() -> None:
    search = CycleSearch(ASKED, still)
    own = search.run()
    timing = TimedSearch(search, duration_of(LONGER))
    found, ours = timing.fastest_cycle(), timing.fastest(own)
    assert found is not None and ours is not None
    assert total_duration(found[1]) <= total_duration(ours) * (1 + CONVERGED)
    assert shortest() == pytest.approx(total_duration(found[1]) + ASKED.dwell_time, rel=CONVERGED)


REFUSALS = {"no time": DeadlineExceeded([]), "no motion": NoTrajectory([])}


@pytest.mark.long
@pytest.mark.parametrize(
    ("where", "problem"),
    long_but(
        [("sharing", "no time")],
        product(["sharing", "motions"], REFUSALS),
    ),
)
def test_time_that_cannot_be_shared_leaves_simpler_cycles(
    where: str, problem: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the allocation of time fails among obstacles, simpler cycles remain.

    A deadline or a missing motion may end the allocation. The evenly slowed moves, and the fastest
    ones with a wait, are known by then.
    """

    def fails(*_: Any) -> Any:
        raise REFUSALS[problem]

    if where == "sharing":
        monkeypatch.setattr(TimeAllocation, "allocate", fails)
    else:
        monkeypatch.setattr(PairSolver, "solve_in", fails)
    for factor, name in ((LONGER, "same_factor"), (SHORTER, "fastest_then_wait")):
        asked = in_time(ASKED, duration_of(factor))
        found = planned(asked)
        assert found.status == "feasible"
        assert found.duration == pytest.approx(asked.duration_max, rel=ROUNDING)
        (taken,) = (each for each in found.baselines if each.name == name)
        assert found.energy.electrical.total == pytest.approx(taken.electrical, rel=ROUNDING)
        # evenly slowed moves need less energy than fast moves with a wait
        assert (sum(move.wait for move in found.moves) > 0) == (factor == SHORTER)


def test_the_effort_on_bounds_does_not_change_the_cycle() -> None:
    asked = replace(
        ASKED,
        stops=[Stop(name="goal", target=HOME + TURN)],
        closed=False,
        duration_max=1.5,
        duration_min=1.5,
        method="time_scaling",
        with_baselines=False,
    )
    rounds = [plan_cycle(replace(asked, bound=bound)) for bound in ("plain", "normal")]
    first, second = (each.moves[0].solution.trajectory.spline for each in rounds)
    assert rounds[0].duration == pytest.approx(1.5) and first == second
    assert rounds[0].lower_bound == rounds[1].lower_bound
