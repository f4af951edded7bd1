"""Energies at places near a place with known best cycles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import Deadline, end_if_stopped
from joulepath.optimizer.placement.nearby_chain import NEARBY
from joulepath.optimizer.placement.place_solver import PlaceResult, PlaceSolver
from joulepath.optimizer.placement.space import Place


class NearbyEnergy:
    """Energies at places, through configurations near the ones of known cycles.

    Args:
        solver: computes the cycles at places.
        start: the result at the first place.
        end: deadline.
        solve: finds the best cycles at a place. It is called far from the place of its last call,
            and in the absence of nearby configurations.
        estimates: whether estimates suffice, if there are any for the cycles.
    """

    def __init__(
        self,
        solver: PlaceSolver,
        start: PlaceResult,
        end: Deadline,
        solve: Callable[[Place], PlaceResult],
        estimates: bool = False,
    ) -> None:
        self.solver, self.end, self.solve = solver, end, solve
        self.known, self.least = start, np.inf
        self._estimates = estimates and solver.can_estimate
        self._memo: dict[bytes, float] = {}

    def __call__(self, x: Array) -> float | None:
        """Energy [J] at coordinates (n,): inf without cycles, None if the time is up."""
        end_if_stopped()
        if self.end.passed:
            return None
        key = np.round(x, 9).tobytes()
        if key not in self._memo:
            value = self._energy(self.solver.space.place(self.known.place.choice, x))
            if value is None and self.end.left < 0:
                return None
            self._memo[key] = np.inf if value is None else value
        return self._memo[key]

    def _energy(self, place: Place) -> float | None:
        solver, known = self.solver, self.known
        cycles = solver.nearby(place, known.visited) if self._is_near(place) else None
        if cycles is None:
            known = self.solve(place)
            cycles = solver.nearby(place, known.visited)
        elif not self._estimates:
            known = solver.solved(place, self.end, KnownMotions(), cycles=cycles)
        estimates = self._estimates and cycles is not None
        value = solver.estimated(cycles or [], self.end) if estimates else known.energy
        if value is not None and value < self.least:
            self.known, self.least = known, value
        return value

    def _is_near(self, place: Place) -> bool:
        """Whether the best cycles of a place are likely in the known configurations."""
        scale = [axis.scale for axis in self.solver.space.axes]
        away = np.abs((place.x - self.known.place.x) / scale).max(initial=0.0)
        return bool(away <= NEARBY.reach)
