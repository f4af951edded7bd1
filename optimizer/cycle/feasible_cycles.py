"""Feasible cycles in a given time that need no search beyond known motions.

Besides the cycle with the best allocation of its time, these are: the moves in their own time with
a wait, the same moves uniformly slowed or sped up, and the fastest moves with a wait. The answer is
the cheapest certified one of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add

from joulepath.optimizer.cycle.cycle_baselines import (
    broken_moves,
    cycle_baseline,
    dwell_energies_of_chain,
    rest_sensitivity_of_chain,
)
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleBaselineName, CycleEnergies
from joulepath.optimizer.cycle.lazy_search import Pair
from joulepath.optimizer.cycle.time_allocation import total_duration
from joulepath.optimizer.cycle.timed_cycle import TimedChain, TimedSearch
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import MotionEnergy
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from joulepath.optimizer.motion.spline import Spline, lasting, retimed
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.baseline_comparison import NOT_CONFIRMED
from joulepath.optimizer.search.state import ENERGY_TOLERANCE


@dataclass(frozen=True)
class FeasibleCycleSettings:
    """Settings of the cycles that need no search."""

    slowing: float = 1e-3
    """Relative slowing of all moves for the derivative of the energy by the time."""
    rounding: float = 1e-9
    """Relative rounding error of sums of energies or durations in another order."""


FEASIBLE = FeasibleCycleSettings()


@dataclass(frozen=True)
class FeasibleCycle:
    """A cycle with known motions.

    Attributes:
        timing: search in the given time.
        nodes: chain of the cycle.
        motions: motion of every move.
        wait_after: number of the move before the wait.
        wait_time: duration of the wait [s].
        wait_energy: energy of the wait, without the dwell at this stop [J].
        name: name as a baseline; None if the cycle is not reported as one.
        solutions: certified moves; None if they are not certified yet.
    """

    timing: TimedSearch
    nodes: list[int]
    motions: list[Spline]
    wait_after: int
    wait_time: float
    wait_energy: float
    name: CycleBaselineName | None = None
    solutions: list[Solution] | None = None

    @classmethod
    def of(
        cls,
        timing: TimedSearch,
        nodes: list[int],
        motions: Sequence[Spline],
        name: CycleBaselineName | None = None,
        solutions: list[Solution] | None = None,
        until: float | None = None,
    ) -> FeasibleCycle:
        """The cycle that spends the remaining time on a wait where it costs least.

        Args:
            timing: search in the given time.
            nodes: chain of the cycle.
            motions: motion of every move.
            name: name as a baseline.
            solutions: certified moves, if known.
            until: time of all moves and the wait [s]; None for the time of `timing`.
        """
        end = timing.time if until is None else until
        wait_time = end - sum(spline.duration for spline in motions)
        wait_time = wait_time if wait_time > FEASIBLE.rounding * end else 0.0
        wait_after, wait_energy = timing.cheapest_wait(nodes, wait_time)
        return cls(
            timing, nodes, list(motions), wait_after, wait_time, wait_energy, name, solutions
        )

    @property
    def search(self) -> CycleSearch:
        """Search with the nodes of the chain."""
        return self.timing.search

    @cached_property
    def cost(self) -> float:
        """Objective [J], dwells and wait included."""
        wait = self.wait_energy if self.search.cycle.objective == "electrical" else 0.0
        return self._moving_cost(self.motions) + self.search.dwells(self.nodes) + wait

    def _moving_cost(self, motions: Sequence[Spline]) -> float:
        prepared = (self.search.legs[k].prepared for k, _, _ in self.search.pairs(self.nodes))
        return sum(leg.cost_of(spline) for leg, spline in zip(prepared, motions, strict=True))

    @property
    def price(self) -> float:
        """Saving by one more second [W]: by a longer wait if there is one, otherwise by slowing all
        moves.
        """
        if self.wait_time > 0:
            return -self.timing.waiting_power(self.nodes, self.wait_after)
        slower = self._moving_cost(
            [retimed(spline, 1 + FEASIBLE.slowing) for spline in self.motions]
        )
        saved = self._moving_cost(self.motions) - slower
        return saved / (FEASIBLE.slowing * sum(spline.duration for spline in self.motions))

    @cached_property
    def unconfirmed(self) -> list[PlannedMove] | None:
        """Moves whose motions the certificate does not confirm; None if the time is up."""
        if self.solutions is not None:
            return []
        search = self.search
        motions = zip(search.cycle.moves, search.pairs(self.nodes), self.motions, strict=True)
        try:
            with watch(search.end):
                return [
                    move
                    for move, pair, spline in motions
                    if not search.solver.confirms(*pair, spline)
                ]
        except DeadlinePassed:
            return None

    def certified(self) -> FeasibleCycle | None:
        """The cycle with its solutions; None if a motion is not confirmed, or the time is up."""
        if self.solutions is not None:
            return self
        pairs = zip(self.search.pairs(self.nodes), self.motions, strict=True)
        try:
            return replace(
                self,
                solutions=[self.search.solver.certified(*pair, spline) for pair, spline in pairs],
            )
        except (NoTrajectory, DeadlineExceeded):
            return None

    def baseline(self, ours: CycleEnergies) -> CycleBaseline | None:
        """The cycle as a baseline of ours.

        Returns:
            The baseline; None if the time is up, or if the cycle is cheaper than ours and would
            have been the answer with more time.
        """
        if self.name is None or self.unconfirmed is None:
            return None
        if not self.unconfirmed and self.cost < ours.of(self.search.cycle.objective) * (
            1 - FEASIBLE.rounding
        ):
            return None
        search = self.search
        legs = [search.legs[k].prepared for k, _, _ in search.pairs(self.nodes)]
        moving = [leg.energy(spline) for leg, spline in zip(legs, self.motions, strict=True)]
        resting_energy = sum(dwell_energies_of_chain(search, self.nodes)) + self.wait_energy
        electrical = sum(each.electrical.total for each in moving) + resting_energy
        sensitivity = reduce(
            add, [leg.sensitivity(spline) for leg, spline in zip(legs, self.motions, strict=True)]
        )
        sensitivity += rest_sensitivity_of_chain(
            search, self.nodes, self.wait_after, self.wait_time
        )
        length = sum(spline.duration for spline in self.motions)
        theirs = CycleEnergies(
            MotionEnergy(electrical, sensitivity, length),
            sum(each.mechanical.total for each in moving),
        )
        duration = length + self.wait_time + search.cycle.dwell_time
        broken = broken_moves((move, NOT_CONFIRMED) for move in self.unconfirmed)
        return cycle_baseline(search.cycle, self.name, duration, theirs, broken, ours)


def allocated_cycle(timing: TimedSearch, timed: TimedChain) -> FeasibleCycle:
    """The cycle of a timed chain, its moves in their allocated durations.

    Raises:
        JoulepathError: the errors of `optimize`.
    """
    solutions = _solutions(timing, timed.nodes, timed.allocation.durations)
    motions = [each.trajectory.spline for each in solutions]
    return FeasibleCycle(
        timing,
        timed.nodes,
        motions,
        timed.wait_after,
        timed.allocation.waited,
        timed.wait_energy,
        None,
        solutions,
    )


def waitless_cycle(timing: TimedSearch, timed: TimedChain) -> FeasibleCycle | None:
    """The cycle of a timed chain with its wait shared out among the moves, for mechanical work.

    Motions at a price of time are too short, because the smoothed |tau v| of the NLP is positive at
    rest. True work at rest is zero, so longer motions may need less.

    Returns:
        The cycle; None without a wait, for electrical energy, or if a motion is not found.
    """
    allocation = timed.allocation
    if timing.cycle.objective != "mechanical" or not allocation.waited:
        return None
    factor = min(
        1 + allocation.waited / allocation.moving_time,
        DURATIONS.longest / max(allocation.durations),
    )
    try:
        solutions = _solutions(timing, timed.nodes, [factor * T for T in allocation.durations])
    except JoulepathError:
        # the cycle with its wait is known
        return None
    motions = [each.trajectory.spline for each in solutions]
    return FeasibleCycle.of(timing, timed.nodes, motions, solutions=solutions)


def _solutions(timing: TimedSearch, nodes: list[int], lengths: Sequence[float]) -> list[Solution]:
    """Certified motions of a chain in given durations [s]; raises the errors of `optimize`."""
    pairs = zip(timing.search.pairs(nodes), lengths, strict=True)
    own = timing.search.solutions
    return [
        own[pair]
        if pair in own and own[pair].duration == length
        else _solved_in(timing, pair, length)
        for pair, length in pairs
    ]


def _solved_in(timing: TimedSearch, pair: Pair, length: float) -> Solution:
    """Certified motion of a pair in a duration [s]: no dearer than known faster motions slowed to
    it.
    """
    search, found = timing.search, None
    cost_of, objective = search.legs[pair[0]].prepared.cost_of, search.cycle.objective
    slowed = [
        lasting(each.spline, length) for each in timing.motions_of(pair) if each.duration <= length
    ]
    best = min(slowed, key=cost_of, default=None)
    try:
        found = search.solver.solve_in(*pair, length)
    except NoTrajectory:
        if best is None:
            raise
    if best is None or (
        found is not None and found.energy.of(objective) <= cost_of(best) * (1 + ENERGY_TOLERANCE)
    ):
        assert found is not None
        return found
    try:
        return search.solver.solve_in(*pair, length, [best])
    except (NoTrajectory, DeadlineExceeded):
        if found is None:
            raise
        return found


def simple_cycles(
    timing: TimedSearch, chains: Sequence[list[int]], fastest: bool
) -> list[FeasibleCycle]:
    """Feasible cycles that need no search.

    Args:
        timing: search in the given time.
        chains: chains with known motions.
        fastest: whether to include the cycle of the fastest moves.
    """
    search, found = timing.search, list[FeasibleCycle]()
    for nodes in chains:
        solutions = [
            search.solutions[pair] for pair in search.pairs(nodes) if pair in search.solutions
        ]
        if search.cycle.objective == "mechanical":
            # a move of least mechanical work has no best duration: the fastest moves are slowed
            own = [each.spline for each in timing.fastest(nodes) or []]
        else:
            own = [each.trajectory.spline for each in solutions]
            found += _without_speed_change(timing, nodes, own, solutions)
        if len(own) == len(search.legs):
            factor = timing.time / sum(spline.duration for spline in own)
            slowed = [lasting(spline, spline.duration * factor) for spline in own]
            found.append(FeasibleCycle.of(timing, nodes, slowed, "same_factor"))
    fast = timing.fastest_cycle() if fastest else None
    if fast is not None and total_duration(fast[1]) <= timing.time:
        nodes, motions = fast[0], [each.spline for each in fast[1]]
        found += [
            FeasibleCycle.of(timing, nodes, motions, "fastest_then_wait"),
            *_without_speed_change(timing, nodes, motions),
        ]
    return found


def _without_speed_change(
    timing: TimedSearch,
    nodes: list[int],
    motions: list[Spline],
    solutions: list[Solution] | None = None,
) -> list[FeasibleCycle]:
    """The cycle of these motions with the shortest allowed wait; empty if it takes too long."""
    cycle, moving = timing.cycle, sum(spline.duration for spline in motions)
    until = cycle.clamped_duration(moving + cycle.dwell_time) - cycle.dwell_time
    if len(motions) < len(timing.legs) or until < moving * (1 - FEASIBLE.rounding):
        return []
    return [FeasibleCycle.of(timing, nodes, motions, None, solutions, until)]
