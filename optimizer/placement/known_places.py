"""Memo of the cycles found at places, and what they tell about other places."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.placement.rounds import Round
from joulepath.optimizer.placement.space import Key, Place


@dataclass(frozen=True, eq=False)
class KnownPlaces:
    """Memo of rounds at places.

    Args:
        scale: what counts like a metre of each coordinate, shape (n,).
    """

    scale: Array
    _memo: dict[Key, Round] = field(default_factory=dict)
    _ratios: list[float] = field(default_factory=list)

    def recall(self, place: Place) -> Round | None:
        """The round at a place; None if it is not known."""
        return self._memo.get(place.key)

    def keep(self, found: Round, bound: float | None) -> None:
        """Store a round without its solutions.

        Args:
            found: the round.
            bound: bound [J] from the check of its place, before the cycles were computed; None
                without one.
        """
        self._memo[found.place.key] = found.summary
        if found.energy is not None and bound is not None and bound > 0:
            self._ratios.append(found.energy / bound)

    @property
    def by_energy(self) -> list[Round]:
        """Rounds with cycles, the one of least energy first."""
        found = [each for each in self._memo.values() if each.energy is not None]
        return sorted(found, key=lambda each: each.energy or 0.0)

    @property
    def ratios(self) -> tuple[float, float] | None:
        """Least and greatest ratio [1] of the energy at a place to the bound from its check; None
        if there is no such place."""
        return (min(self._ratios), max(self._ratios)) if self._ratios else None

    def nearest(self, place: Place) -> Round | None:
        """The round with cycles nearest to a place, with the same mounts and listed places; None
        without one."""
        same = [each for each in self.by_energy if each.place.choice == place.choice]
        return min(same, key=lambda each: self._distance(place, each.place), default=None)

    def _distance(self, a: Place, b: Place) -> float:
        return float(np.linalg.norm((a.x - b.x) / self.scale))
