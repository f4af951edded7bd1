"""The cycles of least energy at a place, or the reason why there are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.cycle.known_motions import KnownMotions, knowing
from joulepath.optimizer.cycle.neighbouring_configurations import visited_configurations
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import (
    DeadlineExceeded,
    JoulepathError,
    NoConfigurationFound,
    NoTrajectory,
    OutsideLimits,
    SingularPose,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.placement.nearby_chain import Visited, nearby_cycle
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.plan_cycle import plan_cycle
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.progress import no_listener
from joulepath.optimizer.search.errors import (
    DurationTooShort,
    InCollision,
    NoCollisionFreeTrajectory,
    PathInfeasible,
    TorqueInfeasible,
)

Reason = Literal["reach", "collision", "torque", "time", "motion"]


@dataclass(frozen=True)
class PlaceSolverSettings:
    """Settings of the cycles at places."""

    unsolved_excess: float = 0.16
    """Share of the bound by which unsolved moves weigh more than it. At 60 places of 12 cells, the
    cycles of 58 were the same as with 0.1, one needed 1.7 % more, and all took 17 % less time; with
    0.25, five needed up to 5.7 % more, for 31 % less time."""
    least_time: float = 1e-3
    """Least deadline of a cycle [s]."""


PLACE_SOLVER = PlaceSolverSettings()

REASONS: tuple[tuple[type[JoulepathError], Reason], ...] = (
    (UnreachablePose, "reach"),
    (NoConfigurationFound, "reach"),
    (SingularPose, "reach"),
    (UnreachableTargets, "reach"),
    (OutsideLimits, "reach"),
    (PathInfeasible, "reach"),
    (InCollision, "collision"),
    (NoCollisionFreeTrajectory, "collision"),
    (TorqueInfeasible, "torque"),
    (CycleTooShort, "time"),
    (DurationTooShort, "time"),
    (NoSequence, "motion"),
    (NoTrajectory, "motion"),
)
"""Reasons of the errors of cycles; the first class that an error belongs to counts."""


@dataclass(frozen=True, eq=False)
class PlaceResult:
    """Result of the search at a place.

    Attributes:
        place: the place.
        energy: objective of all cycles times their weights [J]; None without certified cycles.
        solutions: the certified cycles; may be empty.
        reason: why there are no cycles; None with cycles, or if there was no time to search.
        error: the error of the first cycle without a solution.
        bound: lower bound of the objective at this place [J]; None if unknown.
        visited: configurations of the cycles; empty without cycles.
    """

    place: Place
    energy: float | None = None
    solutions: tuple[CycleSolution, ...] = ()
    reason: Reason | None = None
    error: JoulepathError | None = None
    bound: float | None = None
    visited: tuple[Visited, ...] = ()

    @property
    def summary(self) -> PlaceResult:
        """The result without its solutions and its error, to save memory."""
        return replace(self, solutions=(), error=None)

    @property
    def is_decided(self) -> bool:
        """Whether the place has cycles, or a reason why not."""
        return self.energy is not None or self.reason is not None


def reason_of(error: JoulepathError) -> Reason | None:
    """Why there is no cycle; None for an error independent of the place."""
    if isinstance(error, PathInfeasible) and any(
        each.reason == "in_collision" for each in error.attempts
    ):
        return "collision"
    return next((reason for kind, reason in REASONS if isinstance(error, kind)), None)


class PlaceSolver:
    """Computes the cycles at places.

    Args:
        space: the places.
        clock: returns the current time [s].
    """

    def __init__(self, space: Space, clock: Clock) -> None:
        self.space, self.clock = space, clock
        self.evaluated = 0
        self.weights = [each.weight for each in space.placement.cycles]

    def checked(self, place: Place, end: Deadline) -> PlaceResult:
        """Whether the stops can be reached at a place, and a lower bound.

        Args:
            place: the place.
            end: deadline.

        Returns:
            A result with a reason, or with a bound alone. The bound is None if none is known for
            all configurations.
        """
        total: float | None = 0.0
        for weight, cycle in zip(self.weights, self.space.cycles(place), strict=True):
            try:
                bound = self._bound(replace(cycle, deadline=max(end.left, PLACE_SOLVER.least_time)))
            except DeadlineExceeded:
                return PlaceResult(place)
            except JoulepathError as error:
                return _failed(place, error)
            total = None if total is None or bound is None else total + weight * bound
        return PlaceResult(place, bound=total)

    def _bound(self, cycle: Cycle) -> float | None:
        """Lower bound [J] of a cycle at its place; None if it takes as long as the cycle itself."""
        if (
            cycle.order is not None
            or cycle.has_passes
            or any(
                True in stop.free_ends or (stop.path is not None and stop.path.split)
                for stop in cycle.stops
            )
        ):
            return None
        search = CycleSearch(cycle, self.clock)
        if not all(leg.closed for leg in search.legs):
            return None
        bound, nodes = LeastChain([leg.least_costs for leg in search.legs], cycle.closed).find()
        return bound if nodes else None

    def solved(
        self,
        place: Place,
        end: Deadline,
        known: KnownMotions,
        compared: bool = False,
        cycles: Sequence[Cycle] | None = None,
    ) -> PlaceResult:
        """The cycles at a place.

        Args:
            place: the place.
            end: deadline; motions certified before it count.
            known: memo of motions; new motions are added.
            compared: whether to search in full, and for baselines; else the configurations are
                only likely the best.
            cycles: the cycles to solve; None for the cycles of the place.

        Returns:
            The result; without energy and reason if there was no time for all cycles.
        """
        self.evaluated += 1
        found, energy = list[CycleSolution](), 0.0
        cycles = self.space.cycles(place) if cycles is None else cycles
        for k, (weight, cycle) in enumerate(zip(self.weights, cycles, strict=True)):
            share = max(end.left / (len(cycles) - k), PLACE_SOLVER.least_time)
            asked = replace(
                cycle,
                deadline=min(cycle.deadline, share),
                with_baselines=compared,
                unsolved_excess=0.0 if compared else PLACE_SOLVER.unsolved_excess,
                bound="normal" if compared else "plain",
            )
            try:
                with knowing(known):
                    solution = plan_cycle(asked, self.clock, no_listener, progress=False)
            except DeadlineExceeded as error:
                return PlaceResult(place, error=error)
            except JoulepathError as error:
                return _failed(place, error)
            if not all(move.solution.certificate.valid for move in solution.moves):
                return PlaceResult(place, error=NoTrajectory([]), reason="motion")
            found.append(solution)
            energy += weight * solution.energy.of(solution.objective)
        bound = sum(
            weight * each.lower_bound for weight, each in zip(self.weights, found, strict=True)
        )
        visited = map(Visited, map(visited_configurations, found), self.space.stops(place))
        return PlaceResult(place, energy, tuple(found), bound=bound, visited=tuple(visited))

    @property
    def can_estimate(self) -> bool:
        """Whether `estimated` knows the energy of the cycles: they rest at all stops, and are free
        in their time.
        """
        return all(
            each.cycle.objective == "electrical"
            and each.cycle.has_free_duration
            and not each.cycle.has_passes
            and each.cycle.arm.bus.mode != "storage"
            for each in self.space.placement.cycles
        )

    def estimated(self, cycles: Sequence[Cycle], end: Deadline) -> float | None:
        """Energy [J] of cycles with the first motion of every move, neither refined nor certified.

        Of cycles through given configurations, it takes about a third of the time of certified
        cycles, and is greater by 0.5 to 1.5 %, nearly the same at neighbouring places.

        Args:
            cycles: the cycles, all with `can_estimate`.
            end: deadline.

        Returns:
            The energy times the weights: inf without motions, None if the time is up.
        """
        self.evaluated += 1
        energy = 0.0
        for weight, cycle in zip(self.weights, cycles, strict=True):
            asked = replace(
                cycle, deadline=max(end.left, PLACE_SOLVER.least_time), with_baselines=False
            )
            try:
                search = CycleSearch(asked, self.clock)
                nodes = search.explore()
            except DeadlineExceeded:
                return None
            except JoulepathError as error:
                if reason_of(error) is None:
                    raise
                return np.inf
            if search.cut_short:
                return None
            energy += weight * search.cost(nodes)
        return energy

    def nearby(self, place: Place, near: Sequence[Visited]) -> list[Cycle] | None:
        """The cycles at a place through configurations near the ones of another place.

        Args:
            place: the place.
            near: configurations of every cycle at another place.

        Returns:
            The cycles; None if there are no such configurations.
        """
        poses = self.space.stops(place)
        found = list(map(nearby_cycle, self.space.cycles(place), near, poses))
        cycles = [each for each in found if each is not None]
        return cycles if near and len(cycles) == len(found) else None


def _failed(place: Place, error: JoulepathError) -> PlaceResult:
    reason = reason_of(error)
    if reason is None:
        raise error
    return PlaceResult(place, reason=reason, error=error)
