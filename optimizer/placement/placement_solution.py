"""The solution of a placement: best and nominal place, map, tolerance and lower bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np

from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.declared import Count, Internal, Joules, Metres, Ratio, Seconds, Unit
from joulepath.optimizer.placement.place_solver import Reason
from joulepath.optimizer.placement.region import Coordinate, Mount
from joulepath.optimizer.presentation.chart import Chart
from joulepath.optimizer.presentation.result import Result, Rows
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.result.energy import Objective

PlacementStatus = Literal["complete", "cut_short"]


@dataclass(frozen=True, kw_only=True)
class PlacedPose:
    """A pose in the world."""

    position: Annotated[list[float], Unit("m")]
    """Position [x, y, z]."""
    quaternion: Annotated[list[float], Unit("1")]
    """Orientation [x, y, z, w]."""


@dataclass(frozen=True, kw_only=True)
class FoundPlace:
    """A place, and what the cycles need there."""

    base: PlacedPose
    """Pose of the robot base in the world."""
    mount: Mount | None
    """Mount of the base; null for any other orientation."""
    offsets: list[PlacedPose]
    """Pose by which every group of `moves` is moved in the world, in their order; empty without
    groups."""
    energy: Joules
    """Objective of all cycles, times their weights."""
    duration: Seconds
    """Duration of all cycles, times their weights."""
    solutions: Annotated[tuple[CycleSolution, ...], Internal] = field(repr=False)
    """The cycles that were found."""
    placed_cycles: Annotated[tuple[Cycle, ...], Internal] = field(repr=False)
    """The cycles as they were asked for, in the frame of the base at this place."""


@dataclass(frozen=True, kw_only=True)
class MapPoint:
    """A place of the map."""

    base: PlacedPose
    """Pose of the robot base in the world."""
    mount: Mount | None
    """Mount of the base; null for any other orientation."""
    offsets: list[PlacedPose]
    """Pose by which every group of `moves` is moved in the world; empty without groups."""
    energy: Joules | None
    """Objective of all cycles, times their weights; null without certified cycles."""
    lower_bound: Joules | None
    """Lower bound of this objective at this place; null where none is known."""
    reason: Reason | None
    """Why there is no energy: a stop is out of `reach`, or one of its paths is; every configuration
    at a stop is in `collision`, or no way past the obstacles was found; a joint has too little
    `torque` to hold the load; the cycle takes longer than the `time` allows; or no `motion` within
    the limits was found. Null with an energy, and where the deadline came first."""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How precisely a coordinate of the best place must be kept."""

    body: Count
    """Number of the body in `moves`, from 0."""
    coordinate: Coordinate
    """The coordinate; the others stay at the best place."""
    lower: Annotated[float, Unit("m or rad")]
    """Change of this coordinate to the smaller side up to which the cycles were computed, and need
    at most 2 % more; not positive."""
    upper: Annotated[float, Unit("m or rad")]
    """The same to the greater side; not negative."""


@dataclass(frozen=True, kw_only=True)
class SolvedPlacement:
    """The placement of least energy: best and nominal place, and the map between them."""

    objective: Objective
    """The minimised energy."""
    status: PlacementStatus
    """`complete`: every place of the map was decided, and no neighbour of the best place is better.
    A better place between the places of the map may still exist: see `optimality_gap`. `cut_short`:
    the deadline ended the search before."""
    best: FoundPlace
    """The best place found. It never needs more energy than the nominal place."""
    nominal: FoundPlace | None
    """The nominal place; null if its cycles are infeasible, or were not found in time."""
    nominal_reason: Reason | None
    """Why the nominal place has no cycles, as in `map`. Null if it has cycles, or if there was no
    time for them."""
    saving: Ratio | None
    """1 - energy of the best place / energy of the nominal one; null without the latter."""
    lower_bound: Joules | None
    """Lower bound of the objective: at no place of the region do the cycles need less, in any
    configurations. Null where no bound is known."""
    optimality_gap: Ratio | None
    """Energy of the best place / lower_bound - 1: it is above the least possible by at most this
    share. Null if the bound is not positive. For a six-joint arm of Universal Robots' form or with
    a spherical wrist, and a cycle between poses or joint positions, the bound includes the
    configurations at the stops for every place. In other cases it includes only the lengths of the
    paths, the payloads and the rests, and the gap is wide."""
    tolerance: list[Tolerance]
    """How precisely every free coordinate of the best place must be kept. Empty for listed places,
    and if there was no time to find it."""
    resolution: Metres | None
    """Largest distance between neighbouring places of the map; null if its places were listed."""
    map: list[MapPoint]
    """Places all over the region."""
    evaluated: Count
    """Number of places at which the cycles were computed or estimated, including those outside
    the map."""
    left_out: Count
    """Number of places of the map for which there was no time."""
    wall_time: Seconds
    """Wall time of the search."""
    edges: Annotated[Sequence[Coordinate], Internal] = ()
    """Coordinates of the best place that are at an end of their range."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PlacementSolution(Result, SolvedPlacement):
    """The placement of least energy, with the fields of an answer of the service."""

    def _headline(self) -> str:
        saved = "" if self.saving is None else f", {self.saving:.1%} less than the nominal place"
        x, y, z = self.best.base.position
        return (
            f"base at ({x:.3f}, {y:.3f}, {z:.3f}) m, {self.best.energy:.4g} J "
            f"{self.objective}{saved}, {self.status}"
        )

    def _rows(self) -> Rows:
        named = [("best", self.best), ("nominal", self.nominal)]
        rows = (
            (
                name,
                *(f"{value:.4g}" for value in each.base.position),
                f"{each.energy:.4g}",
                f"{each.duration:.4g}",
            )
            for name, each in named
            if each is not None
        )
        return [("place", "x [m]", "y [m]", "z [m]", "energy [J]", "duration [s]"), *rows]

    def _shown(self) -> Any:
        return self

    def _columns(self) -> dict[str, Any]:
        """One row per place of the map."""
        base = [each.base for each in self.map]
        names = ("energy", "lower_bound", "reason", "mount")
        return {
            **{name: [each.position[k] for each in base] for k, name in enumerate("xyz")},
            **{f"q{name}": [each.quaternion[k] for each in base] for k, name in enumerate("xyzw")},
            **{name: [getattr(each, name) for each in self.map] for name in names},
        }

    def _charts(self) -> Sequence[Chart]:
        """The energies of the map in ascending order."""
        energies = np.sort([each.energy for each in self.map if each.energy is not None])
        if not len(energies):
            return []
        place = np.arange(1.0, len(energies) + 1)
        return [Chart(place, "place of the map", "energy [J]", {"energy": energies}, True)]
