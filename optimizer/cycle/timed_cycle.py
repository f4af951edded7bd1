"""Search for the cycle of least energy in a given time.

At the price of time at which the allocation of a chain is exact, the least chain is the best cycle
of all (Lagrangian duality, see `timed_bound`). Chains are therefore tried one after another: the
next one is the least chain at the price of the present one.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from operator import attrgetter

import numpy as np

from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.cycle.lazy_search import Pair
from joulepath.optimizer.cycle.priced_search import (
    PricedMotion,
    PricedPair,
    PricedSearch,
    fastest_motion,
)
from joulepath.optimizer.cycle.rest_energy import holding_powers, long_wait_powers, rest_energy
from joulepath.optimizer.cycle.time_allocation import (
    ALLOCATION,
    Allocation,
    TimeAllocation,
    total_duration,
)
from joulepath.optimizer.cycle.timed_bound import TimedBound
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class TimedSearchSettings:
    """Settings of the search for a cycle in a given time."""

    most_chains: int = 5
    """Most chains tried."""
    improvement: float = 1e-4
    """Relative improvement above which a chain is better."""


TIMED_SEARCH = TimedSearchSettings()


@dataclass(frozen=True)
class TimedChain:
    """A chain with its time allocated to moves and a wait.

    Attributes:
        nodes: nodes of the chain.
        allocation: durations of its moves.
        wait_after: number of the move before the wait.
        wait_energy: energy of the wait beside the dwell there [J].
        energy: objective of the cycle, nearly [J].
        least: lower bound of the objective of this chain in this time [J]; see `Allocation`.
    """

    nodes: list[int]
    allocation: Allocation
    wait_after: int
    wait_energy: float
    energy: float
    least: float = -np.inf


class TimedSearch:
    """Search for the cycle of least energy in a given time.

    `exact`: no other chain can be better, as far as the price of time tells. `sought` are the kinds
    of every leg with an attempted motion at some price.

    Args:
        search: search of the cycle in its own time.
        duration: duration of the cycle with dwells [s].
    """

    def __init__(self, search: CycleSearch, duration: float) -> None:
        self.search, self.cycle, self.legs = search, search.cycle, search.legs
        self.time = duration - self.cycle.dwell_time
        self.longest = min(max(self.time, DURATIONS.least), DURATIONS.longest)
        # only the routes through passes found in the cycle's own time are followed
        self.exact = not self.cycle.has_passes
        # moves before a possible wait
        self._before_wait = [
            k for k, move in enumerate(self.cycle.moves) if self.cycle.may_wait_after(move)
        ]
        self.sought = [set[int]() for _ in self.legs]
        self._fast: PricedSearch | None = None
        self._fastest: dict[Pair, PricedMotion | None] = {}
        self._motions: dict[Pair, list[PricedMotion]] = {}

    def run(self, nodes: list[int] | None) -> TimedChain:
        """The best cycle found.

        Args:
            nodes: chain with known motions to start from; None for the fastest chain.

        Raises:
            CycleTooShort: the fastest cycle found takes longer.
            NoTrajectory: a move has no motion.
            DeadlineExceeded: the time is up.
        """
        best = self._from_own_motions(nodes) if nodes is not None else None
        if best is None:
            best = self._from_fastest()
        with suppress(DeadlineExceeded, NoSequence):
            for _ in range(TIMED_SEARCH.most_chains):
                priced = self._priced(best.allocation.price, self.longest)
                chain = self._explored(priced)
                unsure = (
                    priced.cut_short
                    or priced.failed
                    or (not self._rests_count and priced.leaves_chains)
                )
                self.exact &= not unsure
                if chain == best.nodes:
                    return best
                other = self._allocated(chain)
                if other is None or other.energy > best.energy * (1 - TIMED_SEARCH.improvement):
                    # another chain is as good at this price, and worse in this time
                    break
                best = other
        self.exact = False
        return best

    def _from_own_motions(self, nodes: list[int]) -> TimedChain | None:
        """A chain with its time allocated, or with its known motions if there is no time for it."""
        if self.search.search_end.passed and (known := self.with_known_motions(nodes)) is not None:
            return known
        try:
            found = self._allocated(nodes)
        except DeadlineExceeded:
            found = None
        return self.with_known_motions(nodes) if found is None else found

    def with_known_motions(self, nodes: list[int]) -> TimedChain | None:
        """A chain with its known motions and a wait; None if the motions take too long."""
        found = [self.search.solutions[pair] for pair in self.search.pairs(nodes)]
        durations = [solution.duration for solution in found]
        moving = sum(solution.energy.of(self.cycle.objective) for solution in found)
        waited = self.time - sum(durations)
        if waited < 0 or not self._rests_count:
            return None
        self.exact = False
        wait_after, wait = self.cheapest_wait(nodes, waited)
        price = -self.waiting_power(nodes, wait_after)
        energy = moving + wait + self.search.dwells(nodes)
        allocation = Allocation(price, durations, moving, waited)
        return TimedChain(nodes, allocation, wait_after, wait, energy)

    @property
    def _fast_search(self) -> PricedSearch:
        """Search at a price at which motions are nearly as fast as possible."""
        if self._fast is None:
            self._fast = self._priced(ALLOCATION.prices[-1], DURATIONS.longest)
        return self._fast

    def _priced(self, price: float, longest: float) -> PricedSearch:
        return PricedSearch(self.legs, self.cycle.closed, price, longest, self.search.search_end)

    def _explored(self, priced: PricedSearch) -> list[int]:
        """Nodes of the least chain at a price; its motions are kept."""
        chain = priced.explore()
        for sought, leg in zip(self.sought, priced.legs, strict=True):
            sought.update(leg.solved)
        for pair in self.search.pairs(chain):
            found, known = priced.motions.get(pair), self.motions_of(pair)
            if found is not None and all(found is not motion for motion in known):
                known.append(found)
        return chain

    def motions_of(self, pair: Pair) -> list[PricedMotion]:
        """Known motions of a pair, of any duration; motions found later are appended."""
        if pair not in self._motions:
            own = self.search.solutions.get(pair)
            objective = self.cycle.objective
            self._motions[pair] = (
                []
                if own is None
                else [PricedMotion(own.trajectory.spline, own.energy.of(objective))]
            )
        return self._motions[pair]

    def _from_fastest(self) -> TimedChain:
        """The nearly fastest chain, with its time allocated.

        Raises:
            CycleTooShort: the fastest cycle found takes longer.
            NoTrajectory: a move has no motion.
            DeadlineExceeded: the time is up.
        """
        priced = self._fast_search
        chain = self._explored(priced)
        fast = self.fastest(chain)
        if fast is None or total_duration(fast) > self.time:
            # the motions of the search may be far slower than the fastest ones
            other = self.fastest_cycle()
            if other is not None and (
                fast is None or total_duration(other[1]) < total_duration(fast)
            ):
                chain, fast = other
        if fast is None:
            raise (
                DeadlineExceeded([])
                if priced.cut_short or self.search.search_end.passed
                else NoTrajectory([])
            )
        if total_duration(fast) > self.time:
            if priced.cut_short:
                raise DeadlineExceeded([])
            raise CycleTooShort(total_duration(fast) + self.cycle.dwell_time, self.cycle.dwell_time)
        found = self._allocated(chain)
        if found is None:
            raise NoTrajectory([])
        return found

    def fastest_cycle(self) -> tuple[list[int], list[PricedMotion]] | None:
        """The nearly fastest chain of all, with its fastest motions.

        The chain is found by bounds, or by a search if one of its moves has no motion.

        Returns:
            The nodes and motions; None if no chain is found.
        """
        if self.search.search_end.passed and self._fast is None:
            # its bounds alone take the time that the certificates of known cycles need
            return None
        with suppress(DeadlineExceeded, NoSequence):
            fast_search = self._fast_search
            for find in (fast_search.least_nodes, partial(self._explored, fast_search)):
                nodes = find()
                fast = self.fastest(nodes) if nodes else None
                if fast is not None:
                    return nodes, fast
        return None

    def fastest(self, nodes: list[int]) -> list[PricedMotion] | None:
        """Fastest motions of a chain, no slower than known motions; None if some are not found."""
        found = list[PricedMotion]()
        for pair in self.search.pairs(nodes):
            if pair not in self._fastest:
                self._fastest[pair] = self._fastest_of(pair)
            motion = self._fastest[pair]
            if motion is None:
                return None
            found.append(motion)
        return found

    def _fastest_of(self, pair: Pair) -> PricedMotion | None:
        known = self.motions_of(pair)
        splines = [motion.spline for motion in known]
        found = fastest_motion(self.legs[pair[0]], *pair[1:], self.search.search_end, splines)
        motions = [*known, *([] if found is None else [found])]
        return min(motions, key=attrgetter("duration"), default=None)

    def _allocated(self, nodes: list[int]) -> TimedChain | None:
        """A chain with its time allocated; None if no motions that fast are found."""
        fast = self.fastest(nodes)
        if fast is None or total_duration(fast) > self.time:
            return None
        limits = (self.longest, self.search.search_end)
        moves = TimeAllocation(
            [
                PricedPair(self.legs[k], s, g, *limits, self.motions_of((k, s, g)))
                for k, s, g in self.search.pairs(nodes)
            ]
        )
        try:
            waiting = min(self.waiting_power(nodes, k) for k in self._before_wait)
            allocation = moves.allocate(self.time, waiting, fast)
        except NoTrajectory:
            return None
        wait_after, wait = self.cheapest_wait(nodes, allocation.waited)
        dwells, waiting = self.search.dwells(nodes), wait if self._rests_count else 0.0
        energy = allocation.energy + dwells + waiting
        return TimedChain(nodes, allocation, wait_after, wait, energy, allocation.least + dwells)

    @property
    def _rests_count(self) -> bool:
        """Whether the energy at rest is part of the objective."""
        return self.cycle.objective == "electrical"

    def cheapest_wait(self, nodes: list[int], waited: float) -> tuple[int, float]:
        """Move before the cheapest wait, and energy [J] of this wait beside the dwell there."""
        energies = {k: self._wait_energy(nodes, k, waited) for k in self._before_wait}
        wait_after = min(energies, key=energies.__getitem__)
        return wait_after, energies[wait_after]

    def _wait_energy(self, nodes: list[int], move: int, waited: float) -> float:
        """Energy [J] of a wait beside the dwell after a move."""
        if waited <= 0:
            return 0.0
        node, leg, planned = nodes[move + 1], self.legs[move], self.cycle.moves[move]
        hold = float(holding_powers(planned, leg.goal)[node])
        dwell = rest_energy(self.cycle, planned, planned.dwell, hold)
        return rest_energy(self.cycle, planned, planned.dwell + waited, hold) - dwell

    def waiting_power(self, nodes: list[int], move: int) -> float:
        """Increase of the objective by a further second of a long wait after a move [W]."""
        if not self._rests_count:
            return 0.0
        goal = self.legs[move].goal
        return float(long_wait_powers(self.cycle, self.cycle.moves[move], goal)[nodes[move + 1]])

    def bound(self, price: float, known: float) -> float:
        """Lower bound [J] of all cycles in this time; see `TimedBound.at`."""
        return TimedBound(self.cycle, self.legs, self.time, self.longest).at(price, known)
