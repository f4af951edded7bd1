"""The search for a place, with energies that are given as functions of the place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from joulepath import Cycle, Moved, Region, WeightedCycle
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import NEVER, Clock, Deadline
from joulepath.optimizer.placement import placement_search
from joulepath.optimizer.placement.nearby_chain import Visited
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.placement_search import PlacementSearch
from joulepath.optimizer.placement.rounds import Round, Rounds
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.progress import no_listener
from tests.optimizer.clocks import still
from tests.optimizer.placement.cells import two_stops

RATIO = 1.2  # of the energy of a place to its bound


def bound_at(x: Array) -> float:
    """A bound [J] that rises from one corner, and falls where another configuration is in reach: in
    a part of the region that holds no point of the map.
    """
    in_reach = bool(np.all(np.abs(x - [0.13, -0.09]) < [0.08, 0.06]))
    return 100.0 + 10.0 * float(x[0] - x[1]) - (15.0 if in_reach else 0.0)


class GivenRounds(Rounds):
    """Rounds whose bound is `bound_at` and whose energy is a multiple of it, without cycles."""

    def __init__(self, space: Space, clock: Clock) -> None:
        super().__init__(space, clock)
        self.weights = []

    def checked(self, place: Place, end: Deadline) -> Round:
        return Round(place, bound=bound_at(place.x))

    def solved(
        self,
        place: Place,
        end: Deadline,
        known: KnownMotions,
        compared: bool = False,
        cycles: Sequence[Cycle] | None = None,
    ) -> Round:
        self.evaluated += 1
        bound = bound_at(place.x)
        return Round(place, energy=RATIO * bound, bound=bound)

    def nearby(self, place: Place, near: Sequence[Visited]) -> list[Cycle] | None:
        return None


@pytest.mark.parametrize(("slope", "starts"), [(200.0, 2), (20.0, 7)])
def test_bounds_are_descended_from_local_minima_and_from_where_they_may_fall_below_the_least(
    slope: float, starts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two opposite corners of nine places are local minima. A fall by a tenth below the least bound
    is possible from no other place on a steep slope, and from those up to 111 J on a gentle one.
    """

    def checked(_: Rounds, place: Place, end: Deadline) -> Round:
        low, high = (float(np.abs(place.x - corner).sum()) for corner in (-0.25, 0.25))
        return Round(place, bound=min(100.0 + slope * low, 112.0 + slope * high))

    monkeypatch.setattr(GivenRounds, "checked", checked)
    monkeypatch.setattr(placement_search, "Rounds", GivenRounds)
    region = Region(x=(-0.25, 0.25), y=(-0.25, 0.25))
    placement = Placement(
        cycles=[WeightedCycle(two_stops())], moved=[Moved(region)], resolution=0.25
    )
    search = PlacementSearch(placement, still, no_listener)
    points = [search.checked.check(point, NEVER) for point in search.points]
    found = [each.bound for each in search.checked.least_bounds(points, NEVER)]
    assert found[:2] == [100.0, 112.0]
    assert len(found) == starts


@pytest.mark.long
def test_a_place_between_those_of_the_map_is_found_by_its_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    region = Region(x=(-0.25, 0.25), y=(-0.25, 0.25))
    placement = Placement(
        cycles=[WeightedCycle(two_stops())], moved=[Moved(region)], resolution=0.25
    )
    monkeypatch.setattr(placement_search, "Rounds", GivenRounds)
    search = PlacementSearch(placement, still, no_listener)
    search.run()
    assert search.best is not None and search.best.energy is not None
    least = min(each.energy for each in search.map if each.energy is not None)
    assert search.best.energy < 0.92 * least
