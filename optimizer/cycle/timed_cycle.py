"""A cycle in a given time: the best chain at the price of time, its time shared, and a bound by the
price.

For any price λ of time, a cycle of duration D needs at least min Σ (E + λ T) - λ (D - dwells), the
minimum over all chains and durations: so says Lagrangian duality. A wait is one more part of it, of
power P: λ is not below -P then. At the price that shares the time exactly, the least chain is the
best cycle of all.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from operator import attrgetter

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.cycle.priced_search import (
    MoveOfALeg,
    PricedMotion,
    PricedSearch,
    fastest_motion,
)
from joulepath.optimizer.cycle.rests import holding_powers, long_wait_powers, rest_energy
from joulepath.optimizer.cycle.time_sharing import PRICES, Shared, TimeSharing, duration_of
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION

# chains that are tried, each better than the one before at the price of time that shares this one's
MOST_CHAINS = 5
# relative: a chain is better only by more
BETTER = 1e-4

# leg, start node and goal node of a move
Pair = tuple[int, int, int]
_duration = attrgetter("duration")


@dataclass(frozen=True)
class Timed:
    """A chain whose time is shared. It waits after move `at`, which draws `wait_energy` [J] beside
    the dwell there.

    The objective of the cycle is `energy` [J], nearly. However the time is shared, this chain needs
    `least` [J] or more: see `Shared`.
    """

    nodes: list[int]
    shared: Shared
    at: int
    wait_energy: float
    energy: float
    least: float = -np.inf


class TimedSearch:
    """The search for the cycle of least energy in a time [s], from the `search` of the cycle in its
    own time.

    `exact`: no other chain can be better, as far as the price tells. `sought` are the kinds of each
    leg for which a motion was sought at some price.
    """

    def __init__(self, search: CycleSearch, duration: float) -> None:
        self.search, self.asked, self.legs = search, search.asked, search.legs
        self.time = duration - self.asked.dwelling
        self.longest = min(max(self.time, LEAST_DURATION), LONGEST_DURATION)
        # of the routes through passes, only those found in the cycle's own time are followed
        self.exact = not self.asked.passes
        # moves after which it may wait
        self.places = [
            k for k, move in enumerate(self.asked.moves) if self.asked.may_wait_after(move)
        ]
        self.sought = [set[int]() for _ in self.legs]
        self._fastest: dict[Pair, PricedMotion | None] = {}
        self._motions: dict[Pair, list[PricedMotion]] = {}

    def run(self, nodes: list[int] | None) -> Timed:
        """The best cycle found from that of a chain on, whose motions are known, or from the
        fastest one.

        Raises CycleTooShort, NoTrajectory or DeadlineExceeded.
        """
        best = self._of_the_own(nodes) if nodes is not None else None
        if best is None:
            best = self._of_the_fastest()
        with suppress(DeadlineExceeded, NoSequence):
            for _ in range(MOST_CHAINS):
                priced = self._priced(best.shared.price, self.longest)
                chain = self._explored(priced)
                unsure = (
                    priced.cut_short
                    or priced.failed
                    or (not self._rests_count and priced.leaves_chains)
                )
                self.exact &= not unsure
                if chain == best.nodes:
                    return best
                other = self._of(chain)
                if other is None or other.energy > best.energy * (1 - BETTER):
                    # another chain is as good at this price, and worse in this time
                    break
                best = other
        self.exact = False
        return best

    def _of_the_own(self, nodes: list[int]) -> Timed | None:
        """A chain whose motions are known, with its time shared; as they are, if that is not done
        in time.
        """
        if self.search.search_end.passed and (known := self.as_it_is(nodes)) is not None:
            return known
        try:
            found = self._of(nodes)
        except DeadlineExceeded:
            found = None
        return self.as_it_is(nodes) if found is None else found

    def as_it_is(self, nodes: list[int]) -> Timed | None:
        """The motions of a chain as they are known, the time left over waited out; None if they
        take too long.
        """
        found = [self.search.solutions[each] for each in self.search.pairs(nodes)]
        lengths, needed = (
            [each.duration for each in found],
            sum(each.energy.of(self.asked.objective) for each in found),
        )
        waited = self.time - sum(lengths)
        if waited < 0 or not self._rests_count:
            return None
        self.exact = False
        at, wait = self.cheapest_wait(nodes, waited)
        price = -self.waiting_power(nodes, at)
        energy = needed + wait + self.search.dwells(nodes)
        return Timed(nodes, Shared(price, lengths, needed, waited), at, wait, energy)

    @cached_property
    def _fast_search(self) -> PricedSearch:
        """The search at a price at which motions are nearly as fast as they can be."""
        return self._priced(PRICES[-1], LONGEST_DURATION)

    def _priced(self, price: float, longest: float) -> PricedSearch:
        return PricedSearch(self.legs, self.asked.closed, price, longest, self.search.search_end)

    def _explored(self, priced: PricedSearch) -> list[int]:
        chain = priced.explore()
        for sought, leg in zip(self.sought, priced.legs, strict=True):
            sought.update(leg.solved)
        for each in self.search.pairs(chain):
            found, known = priced.motions.get(each), self.in_hand(each)
            if found is not None and all(found is not motion for motion in known):
                known.append(found)
        return chain

    def in_hand(self, pair: Pair) -> list[PricedMotion]:
        """The motions of a pair that are known, of any duration; what is found later is put to
        them.
        """
        if pair not in self._motions:
            own = self.search.solutions.get(pair)
            objective = self.asked.objective
            self._motions[pair] = (
                []
                if own is None
                else [PricedMotion(own.trajectory.spline, own.energy.of(objective))]
            )
        return self._motions[pair]

    def _of_the_fastest(self) -> Timed:
        """The chain that is nearly the fastest, with its time shared. Raises CycleTooShort or
        NoTrajectory.
        """
        priced = self._fast_search
        chain = self._explored(priced)
        fast = self.fastest(chain)
        if fast is None or duration_of(fast) > self.time:
            # the motions by which the chain was found may be far slower than the fastest ones
            other = self.fastest_cycle()
            if other is not None and (fast is None or duration_of(other[1]) < duration_of(fast)):
                chain, fast = other
        if fast is None:
            raise (
                DeadlineExceeded([])
                if priced.cut_short or self.search.search_end.passed
                else NoTrajectory([])
            )
        if duration_of(fast) > self.time:
            if priced.cut_short:
                raise DeadlineExceeded([])
            raise CycleTooShort(duration_of(fast) + self.asked.dwelling, self.asked.dwelling)
        found = self._of(chain)
        if found is None:
            raise NoTrajectory([])
        return found

    def fastest_cycle(self) -> tuple[list[int], list[PricedMotion]] | None:
        """The chain that is nearly the fastest of all, and its moves as fast as they can be; None
        if it is not found.

        It is that by bounds; where one of its moves has no motion, as among obstacles, that of a
        search.
        """
        if self.search.search_end.passed and "_fast_search" not in vars(self):
            # its bounds alone take the time that cycles in hand need for their certificates
            return None
        with suppress(DeadlineExceeded, NoSequence):
            for find in (self._fast_search.least, partial(self._explored, self._fast_search)):
                nodes = find()
                fast = self.fastest(nodes) if nodes else None
                if fast is not None:
                    return nodes, fast
        return None

    def fastest(self, nodes: list[int]) -> list[PricedMotion] | None:
        """The moves of a chain as fast as they can be, each no slower than any motion of it that is
        known.

        None if some are not found.
        """
        found = list[PricedMotion]()
        for each in self.search.pairs(nodes):
            if each not in self._fastest:
                self._fastest[each] = self._fastest_of(each)
            motion = self._fastest[each]
            if motion is None:
                return None
            found.append(motion)
        return found

    def _fastest_of(self, pair: Pair) -> PricedMotion | None:
        """The motion of a pair of least duration."""
        known = self.in_hand(pair)
        splines = [each.spline for each in known]
        found = fastest_motion(self.legs[pair[0]], *pair[1:], self.search.search_end, splines)
        return min([*known, *([] if found is None else [found])], key=_duration, default=None)

    def _of(self, nodes: list[int]) -> Timed | None:
        """A chain with its time shared; None if no motions that fast are found."""
        fast = self.fastest(nodes)
        if fast is None or duration_of(fast) > self.time:
            return None
        beside = (self.longest, self.search.search_end)
        sharing = TimeSharing(
            [
                MoveOfALeg(self.legs[k], s, g, *beside, self.in_hand((k, s, g)))
                for k, s, g in self.search.pairs(nodes)
            ]
        )
        try:
            if self._rests_count:
                waiting = min(self.waiting_power(nodes, k) for k in self.places)
                shared = sharing.fill(self.time, waiting, fast)
            else:
                shared = sharing.fill_for_work(self.time, fast)
        except NoTrajectory:
            return None
        at, wait = self.cheapest_wait(nodes, shared.waited)
        dwelling, waiting = self.search.dwells(nodes), wait if self._rests_count else 0.0
        return Timed(
            nodes, shared, at, wait, shared.energy + dwelling + waiting, shared.least + dwelling
        )

    @property
    def _rests_count(self) -> bool:
        """Whether what the arm draws at rest is in the objective."""
        return self.asked.objective == "electrical"

    def cheapest_wait(self, nodes: list[int], waited: float) -> tuple[int, float]:
        """The move after which a wait [s] draws least, and its energy [J] beside the dwell
        there."""
        energies = {k: self._wait_energy(nodes, k, waited) for k in self.places}
        at = min(energies, key=energies.__getitem__)
        return at, energies[at]

    def _wait_energy(self, nodes: list[int], move: int, waited: float) -> float:
        """Energy [J] of a wait beside the dwell after a move."""
        if waited <= 0:
            return 0.0
        node, leg, planned = nodes[move + 1], self.legs[move], self.asked.moves[move]
        hold = float(holding_powers(planned, leg.goal)[node])
        dwell = rest_energy(self.asked, planned, planned.dwell, hold)
        return rest_energy(self.asked, planned, planned.dwell + waited, hold) - dwell

    def waiting_power(self, nodes: list[int], move: int) -> float:
        """What every further second of a long wait after a move adds to the objective [W]."""
        return float(self._powers(move)[nodes[move + 1]]) if self._rests_count else 0.0

    def _powers(self, move: int) -> Array:
        return long_wait_powers(self.asked, self.asked.moves[move], self.legs[move].goal)

    def bound(self, price: float, ours: float) -> float:
        """Lower bound [J] on all rounds in the time that is asked for, by a price [W] of time: not
        above what we found, `ours` [J].

        At a price below 0 it holds for every longer time, too, and above 0 for every shorter one.
        -inf where some configurations are not known.
        """
        if not all(leg.closed for leg in self.legs):
            return -np.inf
        price = max(price, -self._least_waiting())
        longest = self._longest_below(ours)
        return min(self._least(price, longest) - price * self.time, ours)

    def _least_waiting(self) -> float:
        """What a second of waiting adds to the objective at least [W]: neither on motors nor on
        brakes may a wait gain by the price of time."""
        if not self._rests_count:
            return 0.0
        return min(
            float(power.min())
            for move, leg in zip(self.asked.moves, self.legs, strict=True)
            for power in (
                holding_powers(move, leg.goal),
                long_wait_powers(self.asked, move, leg.goal),
            )
        )

    def _longest_below(self, ours: float) -> float:
        """Longest duration [s] of a move in any cycle that needs less than `ours` [J] and takes no
        longer than asked.

        Every second draws at least what the electronics do: a cycle with a move of duration T needs
        base · T more than the least chain of Σ (E - base · T).
        """
        longest = self.asked.longest_move
        base = self.asked.arm.base_power if self._rests_count else 0.0
        if longest <= self.longest or base <= 0:
            return longest
        beside = self._least(-base, longest)
        return float(np.clip((ours - beside) / base, LEAST_DURATION, longest))

    def _least(self, price: float, longest: float) -> float:
        """Least sum [J] of bounds on energy + price · duration of a chain's moves, each of at most
        `longest` [s].
        """
        costs = [leg.priced(price, longest).least_costs for leg in self.legs]
        return LeastChain(costs, self.asked.closed).find()[0]
