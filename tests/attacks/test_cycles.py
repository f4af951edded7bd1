"""Cycles in a given time need no more energy than any known simpler cycle.

The claim holds for every duration and for every end of the search by its deadline. A search from
scratch does not find the fastest move of `HARD`, so its time could once not be shared at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pytest

from joulepath import (
    Arm,
    Cycle,
    CycleSolution,
    CycleTooShort,
    DeadlineExceeded,
    FreeOrder,
    Payload,
    Problem,
    Stop,
    optimize,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.feasible_cycles import simple_cycles
from joulepath.optimizer.cycle.order_search import OrderSearch
from joulepath.optimizer.cycle.timed_cycle import TimedSearch
from joulepath.optimizer.dynamics.dwell import holding_power
from joulepath.optimizer.dynamics.plant import Plant
from tests.optimizer.clocks import CountingClock
from tests.optimizer.cycle.cycles import pick_and_place
from tests.optimizer.moves import AMPLE, ROBOT, fixed
from tests.selection import long_but

# the module, hidden by the function of the same name
ENTRY = import_module("joulepath.optimizer.plan_cycle")
# relative: sums of the same energies in another order
ROUNDING = 1e-9
# relative: an optimum from another initial guess
CONVERGED = 2e-3
START = np.array([-1.477, -1.808, 1.483, 1.913, 0.829, -1.357])
GOAL = np.array([-0.341, -2.823, 1.001, 1.472, 0.493, -2.509])
HARD = Cycle(
    arm=Arm(robot=ROBOT, collisions=False),
    start=START,
    stops=[Stop(name="there", target=GOAL)],
    deadline=AMPLE,
)
# rad: joint positions all over the range, each near the one before
WHOLE_RANGE = 2.9
NEAR = 1.5


def in_time(asked: Cycle, duration: float, **given: Any) -> Cycle:
    return replace(asked, duration_min=duration, duration_max=duration, **given)


@cache
def free() -> CycleSolution:
    return plan_cycle(HARD)


def near_cycles(seed: int) -> Cycle:
    """A random cycle of two to four near stops with up to 5 kg, some with a dwell, some closed."""
    rng = np.random.default_rng(seed)
    q, stops = [rng.uniform(-WHOLE_RANGE, WHOLE_RANGE, 6)], list[Stop]()
    for k in range(int(rng.integers(2, 5))):
        q.append(np.clip(q[-1] + rng.uniform(-NEAR, NEAR, 6), -WHOLE_RANGE, WHOLE_RANGE))
        part = Payload(mass=float(rng.uniform(0.0, 5.0)), com=np.array([0.0, 0.0, 0.05]))
        stops.append(
            Stop(name=str(k), target=q[-1], dwell=float(rng.choice([0.0, 0.4])), payload=part)
        )
    return replace(HARD, start=q[0], stops=stops, closed=bool(rng.integers(2)), windings=False)


def waiting_power(found: CycleSolution) -> float:
    """The least power of waiting at a stop [W] on the motors, by Pinocchio's torques."""
    still = np.zeros((1, 6))

    def at_rest(arm: Arm, q: Array) -> float:
        return float(holding_power(arm, Plant(arm).torques(q[None], still, still))[0])

    return min(at_rest(move.planned.arm_after, move.solution.goal.q) for move in found.moves)


def energy(found: CycleSolution) -> float:
    return found.energy.electrical.total


def assert_no_dearer_than_its_baselines(found: CycleSolution) -> None:
    """No baseline within the limits needs less energy than the cycle.

    `controller_default` is left out: its acceleration jumps at its start, so no certificate
    confirms it.
    """
    assert all(move.solution.certificate.valid for move in found.moves)
    assert found.lower_bound <= energy(found) * (1 + ROUNDING)
    for each in found.baselines:
        if each.within_limits and each.name != "controller_default":
            assert energy(found) <= each.electrical * (1 + ROUNDING), each.name


@pytest.mark.long
@pytest.mark.parametrize("duration", long_but([2.5], [1.9, 2.5, 5.0]))
def test_a_cycle_whose_fastest_move_is_hard_to_find_has_its_time_shared(duration: float) -> None:
    """Every share of the time between the two moves, by `optimize`, gives the expected energy."""
    found = plan_cycle(in_time(HARD, duration))
    assert_no_dearer_than_its_baselines(found)
    assert {"same_factor", "fastest_then_wait"} <= {each.name for each in found.baselines}
    assert energy(found) <= energy(free()) + waiting_power(free()) * (duration - free().duration)

    def move(start: Array, goal: Array, length: float) -> float:
        task = Problem(
            arm=HARD.arm, start=start, goal=goal, windings=False, deadline=AMPLE, **fixed(length)
        )
        return optimize(task).energy.electrical.total

    lengths = [share * duration for share in (0.49, 0.505, 0.52)]
    best = min(
        move(START, GOAL, length) + move(GOAL, START, duration - length) for length in lengths
    )
    assert energy(found) == pytest.approx(best, rel=CONVERGED)
    assert found.status == "optimal"


class Spied(CycleSearch):
    """A search whose results the test can read."""

    made: ClassVar[list[CycleSearch]] = []

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self.made.append(self)


def cheapest_known(asked: Cycle) -> Iterator[float]:
    """Energy [J] of the cheapest cycle in the hands of the last search.

    It consists of finished moves and a wait.
    """
    assert asked.duration_max is not None
    search = Spied.made[-1]
    if nodes := search.least_through(search.solutions):
        timing = TimedSearch(search, asked.duration_max)
        known = timing.with_known_motions(nodes)
        if known is not None:
            yield known.energy


@pytest.mark.parametrize("readings", long_but([700], range(100, 2300, 50)))
def test_wherever_the_deadline_ends_it_what_is_in_hand_counts(
    readings: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search cut short anywhere returns the best of its finished cycles.

    The clock moves by a second at each reading, so the deadline passes between two readings.
    """
    monkeypatch.setattr(ENTRY, "CycleSearch", Spied)
    asked = in_time(HARD, 2.5, deadline=float(readings))
    try:
        found = plan_cycle(asked, clock=CountingClock())
    except DeadlineExceeded:
        assert not any(True for _ in cheapest_known(asked))
        return
    assert_no_dearer_than_its_baselines(found)
    assert found.duration == pytest.approx(2.5)
    assert all(energy(found) <= each * (1 + ROUNDING) for each in cheapest_known(asked))


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([1], range(20)))
def test_cycles_need_no_more_than_any_simpler_one_at_any_time(seed: int) -> None:
    """Slower cycles need no more energy than a faster cycle with a wait."""
    asked = near_cycles(seed)
    known, rng = plan_cycle(asked), np.random.default_rng(seed)
    for factor in np.sort(rng.uniform(1.0, 4.0, 3)):
        duration = asked.dwell_time + factor * (known.duration - asked.dwell_time)
        found = plan_cycle(in_time(asked, float(duration)))
        assert_no_dearer_than_its_baselines(found)
        waited = energy(known) + waiting_power(known) * (duration - known.duration)
        assert energy(found) <= waited * (1 + ROUNDING)
        known = found


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_more_time_does_no_more_mechanical_work(seed: int) -> None:
    """A longer cycle may wait, and rests do no work."""
    asked = replace(
        near_cycles(seed), objective="mechanical", duration_max=0.2 + near_cycles(seed).dwell_time
    )
    with pytest.raises(CycleTooShort) as refusal:
        plan_cycle(asked)
    shortest = refusal.value.shortest - asked.dwell_time
    cycles = [
        plan_cycle(replace(asked, duration_max=asked.dwell_time + k * shortest))
        for k in (1.1, 1.6, 3.0)
    ]
    for each in cycles:
        named = [
            baseline
            for baseline in each.baselines
            if baseline.name in ("same_factor", "fastest_then_wait")
        ]
        assert all(
            each.energy.mechanical.total <= other.mechanical * (1 + ROUNDING) for other in named
        )
    for faster, slower in pairwise(cycles):
        assert slower.energy.mechanical.total <= faster.energy.mechanical.total * (1 + CONVERGED)


@pytest.mark.long
def test_simple_cycles_that_are_not_confirmed_are_no_answer() -> None:
    """Moves sped up by half break limits; in their own time, followed by a wait, they do not."""
    for duration, confirmed in ((free().duration / 1.5, False), (free().duration * 1.5, True)):
        search = CycleSearch(in_time(HARD, duration), CountingClock(0.0))
        nodes = search.run()
        cycles = simple_cycles(TimedSearch(search, duration), [nodes], fastest=False)
        (alike,) = (each for each in cycles if each.name == "same_factor")
        assert alike.unconfirmed is not None and (not alike.unconfirmed) is confirmed
        assert (alike.certified() is not None) is confirmed
        assert len(cycles) == 1 + confirmed and alike.wait_time == 0


@pytest.mark.long
def test_a_chain_that_is_finished_is_the_answer_once_the_time_is_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A finished chain is returned when time runs out in the search of the next chain."""
    search = CycleSearch(HARD, CountingClock(0.0))
    explored = [CycleSearch(HARD, CountingClock(0.0)).run()]

    def explore(_: CycleSearch) -> list[int]:
        if not explored:
            raise DeadlineExceeded([])
        return explored.pop()

    nodes = list(explored[0])
    monkeypatch.setattr(CycleSearch, "explore", explore)
    assert search.run() == nodes and search.cut_short
    assert all(each in search.solutions for each in search.pairs(nodes))


@pytest.mark.long
def test_the_given_order_is_the_answer_where_a_free_one_needs_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = pick_and_place(2, 3, windings=False, closed=False)
    stops = [replace(stop, payload=None) for stop in asked.stops]
    asked = replace(asked, stops=stops, order=FreeOrder())
    best = plan_cycle(asked)
    by_name = {stop.name: stop for stop in asked.stops}
    given = replace(asked, stops=[by_name[name] for name in best.order])
    worse = replace(
        asked,
        stops=[by_name[name] for name in (best.order[2], best.order[0], best.order[1])],
        order=None,
    )
    monkeypatch.setattr(OrderSearch, "run", lambda self: worse)
    found = plan_cycle(given)
    assert found.order == best.order and found.status == "feasible"
    assert energy(found) == pytest.approx(energy(best), rel=CONVERGED) and energy(found) < energy(
        plan_cycle(worse)
    )
    assert_no_dearer_than_its_baselines(found)
