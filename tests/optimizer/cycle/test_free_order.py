"""Cycles with a free order of stops: the best order, and constraints on the order."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise, permutations
from typing import Any

import numpy as np
import pytest

from joulepath import (
    ContradictoryOrder,
    Cycle,
    DeadlineExceeded,
    FreeOrder,
    InvalidProblem,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.held_karp import HeldKarp
from tests.optimizer.clocks import CountingClock
from tests.optimizer.cycle.cycles import pick_and_place
from tests.optimizer.cycle.test_lines import with_lines
from tests.optimizer.cycle.test_optimize_cycle import assert_true
from tests.refusals import refusal_of
from tests.selection import long_but

ROUNDING = 1e-9
# relative difference of optima from separate searches
CONVERGED = 2e-3
# readings of the clock after the deadline, as a share of the deadline: its checks, and the
# certification of motions found so far
OVERRUN = 0.05


def inspection(seed: int, count: int, **given: Any) -> Cycle:
    """A cycle without a payload, in free order and without full turns."""
    asked = pick_and_place(seed, count, windings=False)
    stops = [replace(stop, payload=None) for stop in asked.stops]
    return replace(asked, stops=stops, **{"order": FreeOrder()} | given)


def energies(asked: Cycle) -> dict[tuple[str, ...], float]:
    """Energy [J] of the best cycle in every order."""
    found = {}
    for stops in permutations(asked.stops):
        search = CycleSearch(replace(asked, stops=stops, order=None), time.perf_counter)
        found[tuple(stop.name for stop in stops)] = search.cost(search.run())
    return found


@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "count", "closed"),
    long_but([(1, 3, True)], [(1, 3, True), (0, 4, True), (2, 4, False)]),
)
def test_it_is_the_best_of_all_orders(seed: int, count: int, closed: bool) -> None:
    asked = inspection(seed, count, closed=closed)
    found, all_ = plan_cycle(asked), energies(asked)
    assert_true(replace(asked, stops=_in(asked, found.order)), found)
    assert found.status == "optimal"
    assert found.energy.electrical.total == pytest.approx(min(all_.values()), rel=CONVERGED)
    assert found.lower_bound <= min(all_.values())
    given = [each for each in found.baselines if each.name == "given_order"]
    first = tuple(stop.name for stop in asked.stops)
    assert bool(given) == (tuple(found.order) != first)
    assert all(
        each.electrical == pytest.approx(all_[first], rel=CONVERGED) and each.saving > -CONVERGED
        for each in given
    )


def _in(asked: Cycle, order: list[str]) -> list[Any]:
    by_name = {stop.name: stop for stop in asked.stops}
    return [by_name[name] for name in order]


@pytest.mark.parametrize("lines", long_but([False], [False, True]))
def test_parts_are_carried_from_pick_to_place_whatever_the_order(lines: bool) -> None:
    asked = pick_and_place(0, 4, windings=False)
    asked = with_lines(asked) if lines else asked
    pairs = [("stop 0", "stop 1"), ("stop 2", "stop 3")]
    found = plan_cycle(replace(asked, order=FreeOrder(together=pairs)))
    assert [found.order.index(b) - found.order.index(a) for a, b in pairs] == [1, 1]
    carried = {move.planned.start: move.planned.arm.payload.mass for move in found.moves}
    after = {name: carried[f"{name}/retreat" if lines else name] for name in found.order}
    assert after == {"stop 0": 2.0, "stop 1": 0.0, "stop 2": 2.0, "stop 3": 0.0}
    assert found.status == "optimal" and found.joins < ROUNDING


@pytest.mark.long
@pytest.mark.parametrize("windings", [False, True])
def test_twelve_stops(windings: bool) -> None:
    order = FreeOrder(before=[("stop 3", "stop 1")])
    found = plan_cycle(replace(inspection(3, 12, order=order), windings=windings))
    assert len(set(found.order)) == 12 and found.order.index("stop 3") < found.order.index("stop 1")
    assert found.status == "optimal" and all(
        move.solution.certificate.valid for move in found.moves
    )


@pytest.mark.long
@pytest.mark.parametrize("readings", long_but([2000], [200, 2000, 5000, 10_000, 20_000]))
def test_a_deadline_gives_a_cycle_or_says_so(readings: int) -> None:
    clock, asked = CountingClock(), inspection(1, 4, deadline=float(readings))
    try:
        found = plan_cycle(asked, clock=clock)
    except DeadlineExceeded:
        return
    assert found.wall_time <= readings * (1 + OVERRUN)
    assert sorted(found.order) == [f"stop {k}" for k in range(4)]
    assert all(move.solution.certificate.valid for move in found.moves)


@pytest.mark.parametrize(
    ("order", "field", "word"),
    [
        ({"before": [("stop 0", "nowhere")]}, "before.0", "nowhere"),
        ({"together": [("stop 0", "stop 1"), ("stop 1", "stop 2")]}, "together", "one list"),
        ({"together": [("stop 1",)]}, "together.0", "two"),
        ({"before": [("stop 1", "stop 1")]}, "before.0", "two"),
    ],
    ids=str,
)
def test_a_malformed_order_names_its_field(order: dict[str, Any], field: str, word: str) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        inspection(0, 3, order=FreeOrder(**order))
    assert refusal.value.field == field and word in str(refusal.value)


@pytest.mark.parametrize(
    ("order", "names", "word"),
    [
        (
            {"before": [("stop 1", "stop 0")], "together": [("stop 0", "stop 1")]},
            ["stop 0", "stop 1"],
            "together",
        ),
        (
            {
                "before": [("stop 0", "stop 2"), ("stop 2", "stop 1")],
                "together": [("stop 0", "stop 1")],
            },
            ["stop 0", "stop 1", "stop 2"],
            "'stop 2'",
        ),
    ],
    ids=str,
)
def test_a_contradictory_order_names_its_stops(
    order: dict[str, Any], names: list[str], word: str
) -> None:
    with pytest.raises(ContradictoryOrder) as refusal:
        inspection(0, 3, order=FreeOrder(**order))
    assert sorted(refusal.value.names) == names and word in str(refusal.value)


def test_stops_that_come_before_each_other_are_all_named() -> None:
    before = [
        ("stop 0", "stop 1"),
        ("stop 1", "stop 2"),
        ("stop 2", "stop 0"),
        ("stop 0", "stop 3"),
    ]
    with pytest.raises(ContradictoryOrder) as refusal:
        inspection(0, 4, order=FreeOrder(before=before))
    names = refusal.value.names
    assert sorted(names) == ["stop 0", "stop 1", "stop 2"]
    assert all((a, b) in before for a, b in zip(names, [*names[1:], names[0]], strict=True))


def test_a_part_that_is_not_put_down_is_no_free_order() -> None:
    with refusal_of("together"):
        replace(pick_and_place(0, 4), order=FreeOrder())


def test_thirteen_stops_are_too_many() -> None:
    with refusal_of("stops"):
        inspection(0, 13)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_the_least_tour_is_that_of_all_tours(seed: int, closed: bool) -> None:
    """The least tour equals the least of all enumerated tours.

    The costs are random and partly infinite, and some groups precede others.
    """
    rng = np.random.default_rng(seed)
    ends: dict[Any, Any] = {each: _some_ends(rng) for each in (None, 0, 1, 2, 3)}
    sizes = {each: len(nodes) for each, nodes in ends.items()}
    blocks: dict[Any, Array] = {
        (a, b): np.where(
            rng.random((sizes[a], sizes[b])) < 0.2, np.inf, rng.uniform(-2, 9, (sizes[a], sizes[b]))
        )
        for a in sizes
        for b in sizes
        if a != b
    }
    earlier: list[set[int]] = [set(), set(), {0}, set()] if seed % 2 else [set()] * 4
    tours = HeldKarp(ends, earlier, closed)
    # costs may change between two searches: the second one uses the new costs
    for _ in range(2):
        for (a, b), cost in blocks.items():
            if closed or b is not None:
                tours.set_costs(a, b, cost)
        value, groups, nodes = tours.least()
        assert_least(value, groups, nodes, blocks, earlier, closed)
        blocks |= {(None, 0): blocks[None, 0] * 3, (1, 2): blocks[1, 2] / 2}


def _some_ends(rng: np.random.Generator) -> Any:
    """Random indices of ends for a few nodes; several nodes may share an end."""
    return np.unique(np.sort(rng.integers(0, 3, rng.integers(1, 5))), return_inverse=True)[1]


def assert_least(
    value: float,
    groups: list[int],
    nodes: list[int],
    blocks: dict[Any, Array],
    earlier: list[set[int]],
    closed: bool,
) -> None:
    """Check a tour against all tours: its cost is correct and the least."""
    least = np.inf
    for order in permutations(range(4)):
        if any(
            order.index(first) > order.index(k)
            for k, before in enumerate(earlier)
            for first in before
        ):
            continue
        for start in range(len(blocks[None, 0])):
            total = np.where(np.arange(len(blocks[None, 0])) == start, 0.0, np.inf)
            for a, b in pairwise([None, *order]):
                total = (total[:, None] + blocks[a, b]).min(axis=0)
            least = min(
                least, float((total + (blocks[order[-1], None][:, start] if closed else 0.0)).min())
            )
    assert value == pytest.approx(least)
    if np.isfinite(value):
        places = [None, *groups, *([None] if closed else [])]
        own = sum(blocks[a, b][nodes[k], nodes[k + 1]] for k, (a, b) in enumerate(pairwise(places)))
        assert own == pytest.approx(value)
