"""A round in a given time: the best chain at the price of time, its time shared, and a bound by the price.

For any price λ of time, a round of duration D needs at least min Σ (E + λ T) - λ (D - dwells), the minimum over all
chains and durations: so says Lagrangian duality. A wait is one more part of it, of power P: λ is not below -P then. At
the price that shares the time exactly, the least chain is the best round of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.robot import Array
from optimizer.energy.dwell import dwell_energy
from optimizer.exceptions import DeadlineExceeded, NoTrajectory, RoundTooShort
from optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION
from optimizer.sequence.chains import LeastChain
from optimizer.sequence.priced_search import PricedSearch
from optimizer.sequence.round_search import RoundSearch, holding_powers
from optimizer.sequence.time_sharing import PRICES, Shared, TimeSharing
from optimizer.trajectories.spline import Spline

# chains that are tried, each better than the one before at the price of time that shares this one's
MOST_CHAINS = 5
# relative: a chain is better only by more
BETTER = 1e-4


@dataclass(frozen=True)
class Timed:
    """A chain whose time is shared. It waits after move `at`, which draws `wait_energy` [J] beside the dwell there.

    With it, the round draws `energy` [J], nearly.
    """

    nodes: list[int]
    shared: Shared
    at: int
    wait_energy: float
    energy: float


class TimedSearch:
    """The search for the round of least energy in a time [s], from the `search` of the round in its own time."""

    def __init__(self, search: RoundSearch, duration: float) -> None:
        self.search, self.asked, self.legs = search, search.asked, search.legs
        self.time = duration - self.asked.dwelling
        self.longest = min(max(self.time, LEAST_DURATION), LONGEST_DURATION)
        self.exact = True

    def run(self, nodes: list[int]) -> Timed:
        """The best round found from that of a chain on. Raises RoundTooShort, or DeadlineExceeded."""
        best = self._of(nodes, [self.search.solutions[each].trajectory.spline for each in self.search.pairs(nodes)])
        if best is None:
            best = self._of_the_fastest()
        for _ in range(MOST_CHAINS):
            price = best.shared.price
            priced = PricedSearch(self.legs, self.asked.closed, price, self.longest, self.search.search_end)
            chain = priced.explore()
            self.exact &= not (priced.cut_short or priced.failed)
            if chain == best.nodes:
                return best
            other = self._of(chain, [None] * len(self.legs))
            if other is None or other.energy > best.energy * (1 - BETTER):
                # another chain is as good at this price, and worse in this time
                self.exact = False
                return best
            best = other
        self.exact = False
        return best

    def _of_the_fastest(self) -> Timed:
        """The chain that can be fastest, with its time shared. Raises RoundTooShort."""
        end = self.search.search_end
        chain = PricedSearch(self.legs, self.asked.closed, PRICES[-1], LONGEST_DURATION, end).explore()
        guesses = [None] * len(self.legs)
        found = self._of(chain, guesses)
        if found is not None:
            return found
        fast = TimeSharing(self.legs, list(self.search.pairs(chain)), guesses, self.longest, end).fastest()
        dwells = self.asked.dwelling
        raise RoundTooShort(fast.moving + dwells, dwells)

    def fastest_then_waiting(self, timed: Timed) -> tuple[float, float] | None:
        """Duration [s] and energy [J] of the same chain as fast as it can be, all the time that is left waited out."""
        pairs, guesses = list(self.search.pairs(timed.nodes)), [None] * len(self.legs)
        try:
            fast = TimeSharing(self.legs, pairs, guesses, self.longest, self.search.end).fastest()
        except (NoTrajectory, DeadlineExceeded):
            return None
        if fast.moving > self.time:
            return None
        _, wait = self._cheapest_wait(timed.nodes, self.time - fast.moving)
        return self.time + self.asked.dwelling, fast.energy + self._dwells(timed.nodes) + wait

    def _of(self, nodes: list[int], guesses: Sequence[Spline | None]) -> Timed | None:
        """A chain with its time shared; None if it cannot be that fast."""
        waiting = min(float(self.powers(k)[nodes[k + 1]]) for k in range(len(self.legs)))
        sharing = TimeSharing(self.legs, list(self.search.pairs(nodes)), guesses, self.longest, self.search.search_end)
        try:
            shared = sharing.fill(self.time, waiting)
        except NoTrajectory:
            return None
        at, wait = self._cheapest_wait(nodes, shared.waited)
        return Timed(nodes, shared, at, wait, shared.energy + self._dwells(nodes) + wait)

    def _dwells(self, nodes: list[int]) -> float:
        """Energy [J] of the dwells of a chain."""
        return sum(float(self.legs[k].dwell[g]) for k, _, g in self.search.pairs(nodes))

    def _cheapest_wait(self, nodes: list[int], waited: float) -> tuple[int, float]:
        """The move after which a wait [s] draws least, and its energy [J] beside the dwell there."""
        energies = [self._wait_energy(nodes, k, waited) for k in range(len(self.legs))]
        return int(np.argmin(energies)), min(energies)

    def powers(self, k: int) -> Array:
        """Power (n,) [W] of a long wait after move k, in each configuration of its goal."""
        asked = self.asked
        if asked.hold == "motors":
            return self._holding(k)
        arm = asked.arms[min(k + 1, len(asked.stops))]
        return np.full(len(self.legs[k].goal.q), arm.base_power if asked.brake_power is None else asked.brake_power)

    def _holding(self, k: int) -> Array:
        return holding_powers(self.asked.arms[min(k + 1, len(self.asked.stops))], self.legs[k].goal)

    def _wait_energy(self, nodes: list[int], at: int, waited: float) -> float:
        """Energy [J] of a wait beside the dwell after a move."""
        if waited <= 0:
            return 0.0
        asked, node = self.asked, nodes[at + 1]
        dwell = asked.stops[at].dwell if at < len(asked.stops) else 0.0
        arm = asked.arms[min(at + 1, len(asked.stops))]
        whole = dwell_energy(asked.waiting(dwell + waited), arm, float(self._holding(at)[node]), 0.0)
        return whole - float(self.legs[at].dwell[node])

    def bound(self, price: float) -> float:
        """Lower bound [J] on all rounds of this duration, by a price [W] of time.

        -inf where some configurations are not known.
        """
        if any(layer.sampled or not layer.complete for leg in self.legs for layer in (leg.start, leg.goal)):
            return -np.inf
        least = min(float(np.minimum(self.powers(k), self._holding(k)).min()) for k in range(len(self.legs)))
        price = max(price, -least)
        costs = [leg.priced(price, self.longest).cost for leg in self.legs]
        return LeastChain(costs, self.asked.closed).find()[0] - price * self.time
