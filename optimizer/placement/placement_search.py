"""Search for the place of least energy: reach first, then bounds, then cycles, then refinement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import Clock, Deadline, end_if_stopped
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.placement.box_bound import box_bound
from joulepath.optimizer.placement.checked_places import CheckedPlaces
from joulepath.optimizer.placement.errors import NoPlacement, ReasonCounts
from joulepath.optimizer.placement.nearby_energy import NearbyEnergy
from joulepath.optimizer.placement.place_solver import PlaceResult, PlaceSolver, Reason
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.refinement import PATTERN, Box, refined
from joulepath.optimizer.placement.region_bound import region_bound
from joulepath.optimizer.placement.space import Key, Place, Space
from joulepath.optimizer.placement.tolerances import tolerances
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved, Tell


@dataclass(frozen=True)
class PlacementSearchSettings:
    """Settings of the search; the shares are of the deadline."""

    nominal: float = 0.5
    """Share until which the nominal place is computed."""
    checked: float = 0.25
    """Share of the time then left for checks of the map's places for reach and bound."""
    descended: float = 0.4
    """Share until which places of least bound are sought between those of the map."""
    promising: float = 0.6
    """Share until which places are computed that may be better than the best one."""
    refined: float = 0.8
    """Share until which the best places are refined."""
    bounded: float = 0.04
    """Share for the lower bound over boxes of places, at most."""
    mapped: float = 0.92
    """Share until which the rest of the map is computed."""
    measured: float = 0.97
    """Share until which the tolerance is computed."""
    usual_times: float = 6.0
    """Multiple of the mean time of a place that any place may take, so that one place among
    obstacles does not take the time of many."""
    least_time: float = 1.0
    """Time that any place may take [s]."""
    starts: int = 3
    """Most places of the map from which the search is refined."""
    apart: float = 0.75
    """Distance of such places from those before and from what they led to, as a share of the
    distance of neighbours on the map."""
    near_best: float = 0.05
    """Share of the least energy above it up to which a place of the map is refined."""
    same: float = 1e-6
    """Relative difference up to which the energies of two searches at one place are the same."""


SEARCH = PlacementSearchSettings()


class PlacementSearch:
    """Search for one placement.

    Args:
        placement: the request.
        clock: function that returns the time [s].
        tell: gets the progress: places of the map as candidates, and the best place so far.

    Raises:
        InvalidProblem: the nominal place is not in a region, or there are too many places.
    """

    def __init__(self, placement: Placement, clock: Clock, tell: Tell) -> None:
        self.space, self.tell = Space.of(placement), tell
        self.clock, self.deadline = clock, placement.deadline
        self.end = Deadline.after(placement.deadline, clock)
        self.solver = PlaceSolver(self.space, clock)
        self.points = self.space.map()
        self.map = [PlaceResult(place) for place in self.points]
        self.lower_bound = region_bound(self.space)
        self.spacing = self.space.spacing
        axes = self.space.axes
        self.box = Box(
            np.array([axis.low for axis in axes]),
            np.array([axis.high for axis in axes]),
            np.array([axis.scale for axis in axes]),
        )
        self.checked = CheckedPlaces(self.solver, self.box, self.spacing)
        self._times = list[float]()
        self._memo: dict[Key, PlaceResult] = {}
        self._known = KnownMotions()
        self.best: PlaceResult | None = None
        self.nominal: PlaceResult
        self.tolerance: Array | None = None
        self.is_refined = False

    def run(self) -> None:
        """Fill the map, and find the best place.

        Raises:
            NoPlacement: there are cycles at no place.
            DeadlineExceeded: the deadline passed before any place was decided.
        """
        self.tell(CandidatesFound(len(self.points)))
        self.nominal = self._solved(self.space.nominal, self._until(SEARCH.nominal), compared=True)
        self._check_points()
        self._solve_between(self._until(SEARCH.promising))
        self._solve_points(self._until(SEARCH.promising), only_better=True)
        if self.best is not None:
            self._refine(self._until(SEARCH.refined))
        self._raise_bound()
        self._solve_points(self._until(SEARCH.mapped), only_better=False)
        if self.best is None:
            raise self._no_place()
        if not self.is_refined:
            self._refine(self._until(SEARCH.refined))
        self._measure(self._until(SEARCH.measured))
        self._compare()

    @property
    def evaluated(self) -> int:
        """Number of places at which the cycles were computed or estimated."""
        return self.solver.evaluated

    @property
    def left_out(self) -> int:
        """Number of places of the map without a decision."""
        return sum(not each.is_decided for each in self.map)

    def _until(self, share: float) -> Deadline:
        """The instant at a share of the deadline."""
        return self.end.earlier_by((1 - share) * self.deadline)

    @property
    def _least(self) -> float:
        """Least energy found [J]; inf without one."""
        return np.inf if self.best is None or self.best.energy is None else self.best.energy

    def _promises(self, found: PlaceResult) -> bool:
        """Whether a place may need little more energy than the best one.

        The bound from its check is scaled by the least ratio of energy to such a bound among the
        computed places.
        """
        most = self._least + SEARCH.near_best * abs(self._least)
        bounds = [
            (each.energy, self.checked.bound_of(each.place))
            for each in self._memo.values()
            if each.energy is not None
        ]
        ratios = [energy / bound for energy, bound in bounds if bound is not None and bound > 0]
        return found.bound is None or not ratios or min(ratios) * found.bound <= most

    def _solved(self, place: Place, end: Deadline, compared: bool = False) -> PlaceResult:
        """The cycles at a place, known ones or new ones; the best are kept."""
        end_if_stopped()
        key = place.key
        if key in self._memo:
            return self._memo[key]
        if not compared and self._times:
            usual = SEARCH.usual_times * float(np.mean(self._times))
            end = end.within(max(SEARCH.least_time, usual))
        known, began = KnownMotions(), self.clock()
        found = self.solver.solved(place, end, known, compared)
        if found.is_decided:
            self._memo[key] = found.summary
        # a place out of reach takes no time, and says nothing of others
        if found.energy is not None:
            self._times.append(self.clock() - began)
        if found.energy is not None and found.energy < self._least:
            self.best, self._known = found, known
            self.tell(Improved(found.energy, self.duration(found), self.lower_bound))
        return found

    def duration(self, found: PlaceResult) -> float:
        """Duration of the cycles at a place, times their weights [s]."""
        return sum(
            weight * each.duration
            for weight, each in zip(self.solver.weights, found.solutions, strict=True)
        )

    def _check_points(self) -> None:
        """Check the places of the map for reach and bound, coarsely first."""
        end = self.end.within(SEARCH.checked * self.end.left)
        for k in _coarse_first(len(self.points)):
            end_if_stopped()
            if end.passed:
                return
            self.map[k] = self.checked.check(self.points[k], end)
            if self.map[k].reason is not None:
                self._tell_point(k)

    def _solve_between(self, end: Deadline) -> None:
        """Compute the places of least bound between those of the map, the least bound first."""
        sought = self.checked.least_bounds(self.map, self._until(SEARCH.descended))
        found = {each.place.key: each for each in sought}
        for each in sorted(found.values(), key=lambda each: each.bound or 0.0):
            if end.passed:
                return
            if self._promises(each):
                self._solved(each.place, end)

    def _solve_points(self, end: Deadline, only_better: bool) -> None:
        """Compute the places of the map, the one with the least bound first."""
        open_ = [k for k, each in enumerate(self.map) if not each.is_decided]
        for k in sorted(open_, key=lambda k: self.map[k].bound or 0.0):
            if end.passed:
                return
            if only_better and not self._promises(self.map[k]):
                continue
            bound = self.map[k].bound
            found = self._solved(self.points[k], end)
            self.map[k] = found.summary
            if not found.is_decided:
                self.map[k] = PlaceResult(self.points[k], bound=bound)
                continue
            self._tell_point(k)

    def _tell_point(self, k: int) -> None:
        found = self.map[k]
        failed = found.energy is None
        self.tell(CandidateTried(k, "failed" if failed else "solved", found.bound, found.energy))

    def _refine(self, end: Deadline) -> None:
        """Refine the best places of the map, and of all that were tried."""
        if end.passed:
            return
        for start in self._starts():
            energy = NearbyEnergy(
                self.solver, start, end, lambda place: self._solved(place, end), estimates=True
            )
            step = PATTERN.first_step * self.spacing
            x, ended = refined(energy, start.place.x, self.box, step)
            self._solved(self.space.place(start.place.choice, x), self.end)
            if not ended:
                return
        self.is_refined = True

    def _starts(self) -> Iterator[PlaceResult]:
        """Places to refine from: the best one, then others far from all before."""
        taken = list[Place]()
        found = [each for each in self._memo.values() if each.energy is not None]
        for each in sorted(found, key=lambda each: each.energy or 0.0):
            assert each.energy is not None
            most = self._least + SEARCH.near_best * abs(self._least)
            if len(taken) >= 2 * SEARCH.starts or each.energy > most:
                return
            if any(self._is_near(each.place, other) for other in taken):
                continue
            taken.append(each.place)
            yield each
            assert self.best is not None
            taken.append(self.best.place)

    def _is_near(self, a: Place, b: Place) -> bool:
        """Whether two places are closer than neighbours on the map."""
        same = a.choice == b.choice
        return same and bool((np.abs(a.x - b.x) <= SEARCH.apart * self.spacing).all())

    def _raise_bound(self) -> None:
        """Raise the lower bound, where one over boxes of places is known."""
        bound = box_bound(self.space, self.end.within(SEARCH.bounded * self.deadline))
        if bound is not None and self.lower_bound is not None:
            self.lower_bound = max(bound, self.lower_bound)

    def _measure(self, end: Deadline) -> None:
        """Find how precisely the best place must be kept."""
        best = self.best
        assert best is not None and best.energy is not None
        energy = NearbyEnergy(
            self.solver,
            best,
            end,
            lambda place: self.solver.solved(place, end, KnownMotions()),
        )
        step = self.spacing / 2
        self.tolerance = tolerances(energy, best.place.x, best.energy, self.box, step)

    def _compare(self) -> None:
        """Compute the best place once more, with baselines."""
        assert self.best is not None and self.best.energy is not None
        if self.best.place is self.nominal.place or self.end.passed:
            return
        found = self.solver.solved(self.best.place, self.end, self._known, compared=True)
        if found.energy is not None and found.energy <= self.best.energy * (1 + SEARCH.same):
            self.best = found

    def _no_place(self) -> NoPlacement | DeadlineExceeded:
        found = {each.place.key: each.reason for each in [*self.map, self.nominal]}
        reasons = [reason for reason in found.values() if reason is not None]
        if len(reasons) < len(found):
            return DeadlineExceeded([])
        counts = ReasonCounts(**{name: reasons.count(name) for name in get_args(Reason)})
        return NoPlacement(counts, str(self.nominal.error))


def _coarse_first(count: int) -> list[int]:
    """The numbers below `count` in van der Corput's order, which is even wherever it ends."""
    bits = max(count - 1, 1).bit_length()
    order = (int(f"{k:0{bits}b}"[::-1], 2) for k in range(1 << bits))
    return [k for k in order if k < count]
