"""Places of least bound between those of the map.

Where another configuration comes within reach of the stops, the least energy of a cycle jumps, by
up to a tenth within some centimetres, and the bound jumps with it. A bound takes a tenth of the
time of a cycle, so that a pattern search over bounds finds such places before any cycle is
computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline, end_if_stopped
from joulepath.optimizer.placement.refinement import PATTERN, Box, refined
from joulepath.optimizer.placement.rounds import Round, Rounds
from joulepath.optimizer.placement.space import Key, Place


@dataclass(frozen=True)
class CheckedPlacesSettings:
    """Settings of the search for places of least bound."""

    finest_share: float = 0.2
    """Step below which a search ends, as a share of the distance of neighbours on the map."""


CHECKED_PLACES = CheckedPlacesSettings()


@dataclass(frozen=True, eq=False)
class CheckedPlaces:
    """Places that were checked for reach and bound.

    Args:
        rounds: checks the places.
        box: ranges of the coordinates.
        spacing: distances of neighbours on the map, shape (n,) [m, rad].
    """

    rounds: Rounds
    box: Box
    spacing: Array
    _memo: dict[Key, Round] = field(default_factory=dict)

    def check(self, place: Place, end: Deadline) -> Round:
        """The reason why a place has no cycles, or its bound; known ones or new ones."""
        if place.key not in self._memo:
            found = self.rounds.checked(place, end)
            if end.passed:
                return found
            self._memo[place.key] = found
        return self._memo[place.key]

    def least_bounds(self, starts: Sequence[Round], end: Deadline) -> Iterator[Round]:
        """The place of least bound near each of others, that of least bound first.

        Args:
            starts: places to begin with; those without a bound are left out.
            end: deadline.
        """
        finest = CHECKED_PLACES.finest_share * float(
            (self.spacing / self.box.scale).max(initial=0.0)
        )
        bounded = [each for each in starts if each.reason is None and each.bound is not None]
        for start in sorted(bounded, key=lambda each: each.bound or 0.0):
            bound = _Bound(self, start.place.choice, end)
            step = PATTERN.first_step * self.spacing
            x, ended = refined(bound, start.place.x, self.box, step, finest)
            yield self.check(self.rounds.space.place(start.place.choice, x), end)
            if not ended:
                return


@dataclass(frozen=True, eq=False)
class _Bound:
    """Bounds [J] at coordinates: inf without cycles, None if the time is up."""

    places: CheckedPlaces
    choice: tuple[int, ...]
    end: Deadline

    def __call__(self, x: Array) -> float | None:
        end_if_stopped()
        if self.end.passed:
            return None
        bound = self.places.check(self.places.rounds.space.place(self.choice, x), self.end).bound
        return np.inf if bound is None else bound
