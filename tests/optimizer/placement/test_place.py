"""Placements with a best place known by brute force or by formula; tolerances of coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    CandidatesFound,
    CandidateTried,
    Cycle,
    DeadlineExceeded,
    Improved,
    JoulepathError,
    Moved,
    NoPlacement,
    PlacementSolution,
    Places,
    Region,
    WeightedCycle,
    place,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import NEVER, Clock, Deadline
from joulepath.optimizer.placement import placement_search
from joulepath.optimizer.placement.nearby_chain import Visited
from joulepath.optimizer.placement.place import place_robot
from joulepath.optimizer.placement.place_solver import PlaceResult, PlaceSolver
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.placement_search import PlacementSearch
from joulepath.optimizer.placement.refinement import Box
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.placement.tolerances import TOLERANCE, tolerances
from joulepath.optimizer.progress import Event, no_listener
from tests.optimizer.clocks import still
from tests.optimizer.placement.cells import arm, at, floor, two_stops, wall

AMPLE = 600.0
SCATTER = 2e-3  # relative scatter of solves at places a few millimetres apart


def check(found: PlacementSolution) -> None:
    """Check the promises of every answer."""
    assert found.nominal is None or found.best.energy <= found.nominal.energy
    assert found.lower_bound is not None
    for energy in [found.best.energy, *(each.energy for each in found.map if each.energy)]:
        assert found.lower_bound <= energy
    for one in [found.best, *([] if found.nominal is None else [found.nominal])]:
        for solution in one.solutions:
            assert all(move.solution.certificate.valid for move in solution.moves)
    for each in found.map:
        assert each.energy is None or each.reason is None
        assert each.lower_bound is None or each.energy is None or each.lower_bound <= each.energy
    undecided = [each for each in found.map if each.energy is None and each.reason is None]
    assert len(undecided) == found.left_out


@pytest.mark.long
def test_brute_force_finds_no_better_place() -> None:
    """On a line, no place of a grid of two centimetres has a better cycle."""
    cycle = two_stops([floor()])
    found = place(cycle, Region(x=(-0.25, 0.15)), resolution=0.1, deadline=AMPLE, progress=False)
    check(found)
    assert found.status == "complete" and len(found.map) == 5
    placement = Placement(
        cycles=[WeightedCycle(replace(cycle, with_baselines=False))],
        moved=[Moved(Region(x=(-0.25, 0.15)))],
        resolution=0.02,
    )
    space, energies = Space.of(placement), list[float]()
    for each in space.map():
        (own,) = space.cycles(each)
        try:
            energies.append(plan_cycle(own, progress=False).energy.electrical.total)
        except JoulepathError:
            continue
    assert found.best.energy <= min(energies) * (1 + SCATTER)
    (tolerance,) = found.tolerance
    assert tolerance.lower <= 0 <= tolerance.upper


@pytest.mark.long
def test_the_map_tells_why_there_is_no_cycle() -> None:
    cycle = two_stops([floor(), wall(-0.35)])
    places = [at(-3.0), at(-0.2)]
    found = place(cycle, Places(places), deadline=AMPLE, progress=False)
    check(found)
    assert [each.reason for each in found.map] == [None, "reach", "collision"]
    short = two_stops(duration_max=0.5)
    with pytest.raises(NoPlacement) as raised:
        place(short, Places([at(0.01)]), deadline=AMPLE, progress=False)
    assert raised.value.reasons.time == 2
    weak = two_stops(arm=arm(limits=_weak()))
    with pytest.raises(NoPlacement) as raised:
        place(weak, Places([at(0.01)]), deadline=AMPLE, progress=False)
    assert raised.value.reasons.torque == 2


def _weak() -> object:
    limits = arm().robot.limits
    return limits.tightened(tau_max=np.array([1.0] * 6))


def test_a_bad_nominal_place_does_not_matter() -> None:
    found = place(two_stops(), Places([at(-0.05)]), base=at(-3.0), deadline=AMPLE, progress=False)
    check(found)
    assert found.nominal is None and found.nominal_reason == "reach"
    assert found.saving is None
    assert found.best.base.position == pytest.approx([-0.05, 0.0, 0.0])


@pytest.mark.long
def test_a_deadline_gives_the_best_so_far() -> None:
    ticks = iter(range(10**9))
    placement = Placement(
        cycles=[WeightedCycle(two_stops())],
        moved=[Moved(Region(x=(-0.2, 0.2), y=(-0.2, 0.2)))],
        deadline=40.0,
    )
    found = place_robot(placement, clock=lambda: 0.02 * next(ticks), progress=False)
    check(found)
    assert found.status == "cut_short"


def test_no_time_at_all_is_an_error_of_its_own() -> None:
    with pytest.raises(DeadlineExceeded):
        place(two_stops(), Places([at(0.1)]), deadline=1e-3, progress=False)


def test_places_without_a_decision_are_no_proof_that_there_is_none() -> None:
    ticks = iter(range(10**9))
    placement = Placement(
        cycles=[WeightedCycle(two_stops())], moved=[Moved(Places([at(-3.0)]))], deadline=1.0
    )
    with pytest.raises(DeadlineExceeded):
        place_robot(placement, clock=lambda: 0.02 * next(ticks), progress=False)


@pytest.mark.long
def test_progress_is_told() -> None:
    events = list[Event]()
    found = place(two_stops(), Places([at(-0.05), at(-3.0)]), deadline=AMPLE, tell=events.append)
    (total,) = [each.total for each in events if isinstance(each, CandidatesFound)]
    assert total == len(found.map) == 3
    tried = {each.index: each.status for each in events if isinstance(each, CandidateTried)}
    assert tried == {0: "solved", 1: "solved", 2: "failed"}
    energies = [each.energy for each in events if isinstance(each, Improved)]
    assert energies == sorted(energies, reverse=True)
    assert energies[-1] == pytest.approx(found.best.energy)


LEAST = 150.0
ALLOWED = TOLERANCE.excess * LEAST
BOX = Box(np.array([-0.2]), np.array([0.3]), np.ones(1))
RISES: dict[str, tuple[Callable[[float], float], float]] = {
    "parabola": (lambda x: 400 * x**2, np.sqrt(ALLOWED / 400)),
    "even": (lambda x: 350 * abs(x), ALLOWED / 350),
    "flat": (lambda x: 0.0, 0.3),
    "step": (lambda x: 0.0 if x < 0.1 else np.inf, 0.1),
}


@pytest.mark.parametrize("name", RISES)
def test_most_of_the_tolerance_is_found(name: str) -> None:
    rise, most = RISES[name]
    tried = list[float]()

    def energy(x: Array) -> float:
        tried.append(float(x[0]))
        return LEAST + rise(float(x[0]))

    found = tolerances(energy, np.zeros(1), LEAST, BOX, np.array([0.25]))
    assert found is not None
    lower, upper = found[0]
    assert 0.5 * most < upper <= most and -0.2 <= lower < 0
    assert all(rise(x) <= ALLOWED and x in tried for x in (lower, upper))


def test_no_time_is_left() -> None:
    assert tolerances(lambda x: None, np.zeros(1), LEAST, BOX, np.array([0.1])) is None


RATIO = 1.2  # of the energy of a place to its bound


def bound_at(x: Array) -> float:
    """A bound [J] with a slope and a step, without any point of the map inside the step.

    It rises from one corner. The step down is in a small part of the region, as if another
    configuration came within reach.
    """
    in_reach = bool(np.all(np.abs(x - [0.13, -0.09]) < [0.08, 0.06]))
    return 100.0 + 10.0 * float(x[0] - x[1]) - (15.0 if in_reach else 0.0)


class GivenBounds(PlaceSolver):
    """Places without cycles: the bound is `bound_at`, and the energy a multiple of the bound."""

    def __init__(self, space: Space, clock: Clock) -> None:
        super().__init__(space, clock)
        self.weights = []

    def checked(self, place: Place, end: Deadline) -> PlaceResult:
        return PlaceResult(place, bound=bound_at(place.x))

    def solved(
        self,
        place: Place,
        end: Deadline,
        known: KnownMotions,
        compared: bool = False,
        cycles: Sequence[Cycle] | None = None,
    ) -> PlaceResult:
        self.evaluated += 1
        bound = bound_at(place.x)
        return PlaceResult(place, energy=RATIO * bound, bound=bound)

    def nearby(self, place: Place, near: Sequence[Visited]) -> list[Cycle] | None:
        return None


@pytest.mark.parametrize(("slope", "starts"), [(200.0, 2), (20.0, 7)])
def test_bounds_are_descended_from_local_minima_and_from_where_they_may_fall_below_the_least(
    slope: float, starts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Descents of the bound start at local minima, and near bounds that may fall below the least.

    Two opposite corners of nine places are local minima. With a possible fall of a tenth, no other
    place qualifies on the steep slope, and all places up to 111 J qualify on the gentle slope.
    """

    def checked(_: PlaceSolver, place: Place, end: Deadline) -> PlaceResult:
        low, high = (float(np.abs(place.x - corner).sum()) for corner in (-0.25, 0.25))
        return PlaceResult(place, bound=min(100.0 + slope * low, 112.0 + slope * high))

    monkeypatch.setattr(GivenBounds, "checked", checked)
    monkeypatch.setattr(placement_search, "PlaceSolver", GivenBounds)
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
    monkeypatch.setattr(placement_search, "PlaceSolver", GivenBounds)
    search = PlacementSearch(placement, still, no_listener)
    search.run()
    assert search.best is not None and search.best.energy is not None
    least = min(each.energy for each in search.map if each.energy is not None)
    assert search.best.energy < 0.92 * least
