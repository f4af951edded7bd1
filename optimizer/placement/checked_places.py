"""Checks of places for reach and bound, and the search for places of least bound.

Where another configuration comes within reach of the stops, the least energy of a cycle jumps, by
up to a tenth within some centimetres. The lower bound jumps there as well and takes a tenth of the
time of a cycle. A pattern search on the bound therefore finds places of little energy between the
points of the map before any cycle is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline, end_if_stopped
from joulepath.optimizer.placement.place_solver import PlaceResult, PlaceSolver
from joulepath.optimizer.placement.refinement import PATTERN, Box, refined
from joulepath.optimizer.placement.space import Key, Place


@dataclass(frozen=True)
class CheckedPlacesSettings:
    """Settings of the search for places of least bound."""

    finest_share: float = 0.2
    """Step below which the search ends, as a share of the distance between neighbours on the
    map."""
    greatest_fall: float = 0.1
    """Share by which the bound may fall next to a place of the map, where another configuration
    comes within reach. In eight cells of the benchmark, searches from all places took three times
    as many bounds and led to none below the least."""


CHECKED_PLACES = CheckedPlacesSettings()


@dataclass(frozen=True, eq=False)
class CheckedPlaces:
    """Memo of checks of places for reach and bound.

    Args:
        solver: checks the places.
        box: ranges of the coordinates.
        spacing: distances between neighbours on the map, shape (n,) [m, rad].
    """

    solver: PlaceSolver
    box: Box
    spacing: Array
    _memo: dict[Key, PlaceResult] = field(default_factory=dict)

    def check(self, place: Place, end: Deadline) -> PlaceResult:
        """The lower bound at a place, or the reason why the place has no cycles; neither of them if
        the deadline passes first."""
        if place.key not in self._memo:
            found = self.solver.checked(place, end)
            if end.passed:
                return found
            self._memo[place.key] = found
        return self._memo[place.key]

    def bound_of(self, place: Place) -> float | None:
        """The lower bound [J] at a checked place; None without one."""
        known = self._memo.get(place.key)
        return None if known is None else known.bound

    def least_bounds(self, starts: Sequence[PlaceResult], end: Deadline) -> Iterator[PlaceResult]:
        """Local minima of the bound. The searches begin at the local minima on the map, and then at
        other places while a bound lower by `greatest_fall` would be the least of all.

        Args:
            starts: checked places of the map; places without a bound are left out.
            end: deadline.
        """
        step = PATTERN.first_step * self.spacing
        spacing = float((self.spacing / self.box.scale).max(initial=0.0))
        # a map finer than the search for the least energy leaves nothing between its points
        finest = max(CHECKED_PLACES.finest_share * spacing, PATTERN.finest)
        bounds = {each: each.bound for each in starts if each.bound is not None}
        minima = self._minima(bounds)
        least = np.inf
        for start in sorted(bounds, key=lambda each: (each not in minima, bounds[each])):
            fallen = bounds[start] - CHECKED_PLACES.greatest_fall * abs(bounds[start])
            if start not in minima and fallen > least:
                return
            choice = start.place.choice
            bound = partial(self._bound_at, choice, end)
            x, ended = refined(bound, start.place.x, self.box, step, finest)
            found = self.check(self.solver.space.place(choice, x), end)
            least = min(least, np.inf if found.bound is None else found.bound)
            yield found
            if not ended:
                return

    def _minima(self, bounds: Mapping[PlaceResult, float]) -> set[PlaceResult]:
        """Places of the map at which the bound is no greater than one step of one coordinate
        away."""
        steps = {each: self._steps(each.place.x) for each in bounds}
        at = {(each.place.choice, steps[each]): bound for each, bound in bounds.items()}

        def around(place: PlaceResult) -> Iterator[float]:
            """Bounds of the neighbours that have one."""
            numbers = steps[place]
            for k, number in enumerate(numbers):
                for other in (number - 1, number + 1):
                    key = place.place.choice, (*numbers[:k], other, *numbers[k + 1 :])
                    yield at.get(key, np.inf)

        return {
            each for each, bound in bounds.items() if bound <= min(around(each), default=np.inf)
        }

    def _steps(self, x: Array) -> tuple[int, ...]:
        """Numbers of coordinates (n,) of the map, counted from the lower ends of their ranges."""
        return tuple(np.rint((x - self.box.low) / self.spacing).astype(int).tolist())

    def _bound_at(self, choice: tuple[int, ...], end: Deadline, x: Array) -> float | None:
        """Bound [J] at coordinates (n,): inf without a bound, None if the time is up."""
        end_if_stopped()
        if end.passed:
            return None
        bound = self.check(self.solver.space.place(choice, x), end).bound
        return np.inf if bound is None else bound
