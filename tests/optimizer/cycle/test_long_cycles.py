"""Cycles of many stops: fewer motions for the same cycle, news on the way, the best one at a
deadline, and shared models of arms.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from joulepath import Arm, BranchFilter, Cycle, CycleSolution, Improved, Payload, plan_cycle
from joulepath.optimizer import surroundings
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.cycle import cycle_search, legs
from joulepath.optimizer.cycle.cycle_search import CYCLE_SEARCH, CycleSearch
from joulepath.optimizer.progress import Event
from tests.optimizer.clocks import CountingClock, still
from tests.optimizer.cycle.cycles import PART, pick_and_place
from tests.optimizer.placement.cells import floor, two_stops
from tests.refusals import refusal_of

# a counting clock never comes to it
ENDLESS = 1e9
# share of a whole search's clock readings by which the cycle is found, with the search going on
ENOUGH = 0.75


def long_cycle(deadline: float) -> Cycle:
    """A cycle with one stop more than the largest one solved to proven optimality."""
    asked = pick_and_place(
        1, CYCLE_SEARCH.many_stops + 1, windings=False, method="time_scaling", deadline=deadline
    )
    only = BranchFilter(elbow="up", wrist="no_flip")
    return replace(asked, stops=[replace(stop, branch=only) for stop in asked.stops])


Whole = tuple[CycleSolution, list[Event], float]


@pytest.fixture(scope="module")
def whole() -> Whole:
    """The long cycle without a deadline, its events, and its number of clock readings."""
    events, clock = list[Event](), CountingClock()
    found = plan_cycle(long_cycle(ENDLESS), clock, events.append)
    return found, events, clock.now


@pytest.mark.long
def test_a_long_cycle_tells_what_it_finds_on_the_way(whole: Whole) -> None:
    found, events, _ = whole
    told = [each for each in events if isinstance(each, Improved)]
    assert len(told) > 1 and all(a.energy > b.energy for a, b in pairwise(told))
    assert told[-1].energy == pytest.approx(found.energy.electrical.total)
    assert all(each.bound == pytest.approx(found.lower_bound) for each in told)


@pytest.mark.long
def test_a_deadline_gives_the_best_long_cycle_so_far(whole: Whole) -> None:
    best, _, readings = whole
    found = plan_cycle(long_cycle(ENOUGH * readings), CountingClock())
    assert found.status == "feasible" and found.order == best.order
    assert all(move.solution.certificate.valid for move in found.moves) and found.joins < 1e-9
    assert found.lower_bound == best.lower_bound
    assert found.energy.electrical.total >= best.energy.electrical.total
    assert sum(move.solved for move in found.moves) < sum(move.solved for move in best.moves)


@pytest.mark.long
def test_the_proof_alone_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = pick_and_place(5, 4, method="time_scaling")
    proven = plan_cycle(asked)
    monkeypatch.setattr(cycle_search, "CYCLE_SEARCH", replace(CYCLE_SEARCH, many_stops=1))
    found = plan_cycle(asked)
    assert found.energy.electrical.total == proven.energy.electrical.total
    assert found.lower_bound == proven.lower_bound
    assert sum(move.solved for move in found.moves) < sum(move.solved for move in proven.moves)
    assert (proven.status, found.status) == ("optimal", "feasible")


def test_too_many_pairs_of_all_moves_are_refused_before_any_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(legs, "LEG", replace(legs.LEG, most_pairs_of_cycle=100))
    with refusal_of("stops", match="fewer stops"):
        plan_cycle(pick_and_place(1, 3, windings=False))


def test_moves_with_the_same_payload_share_an_arm() -> None:
    asked = pick_and_place(1, 3)
    same = Payload(mass=PART.mass, com=np.array(PART.com))
    arms = replace(asked, stops=[*asked.stops[:2], replace(asked.stops[2], payload=same)]).arms
    assert arms[0] is arms[2] and arms[1] is arms[3] and arms[0] is not arms[1]


def test_each_arm_of_a_cycle_has_one_collision_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cycle builds one collision model with the part and one without it.

    The start and both stops share the two models.
    """
    built = list[Arm]()

    def counted(arm: Arm) -> CollisionModel:
        built.append(arm)
        return collision_model(arm)

    monkeypatch.setattr(surroundings, "collision_model", counted)
    search = CycleSearch(two_stops([floor()]), still)
    search.explore()
    payloads = sorted(arm.payload.mass for arm in built)
    assert payloads == [0.0, 2.0]
