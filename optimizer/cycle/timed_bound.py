"""Lower bound of cycles in a given time, by a price of time (Lagrangian duality).

For any price λ of time, a cycle of duration D needs at least min Σ (E + λ T) - λ (D - dwells), with
the minimum over all chains and durations T. A wait of power P is one more summand, so λ ≥ -P must
hold.

The price of the best cycle is not the best price of its bound. Where there is time to spare, a
further second of a move saves as much as one of waiting costs, P, with the holding of the load. The
bounds of single moves leave out this loss: at a price near -P they fall with every second, until
the longest possible one. Therefore a second price is tried, just above minus the power that these
bounds have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.rest_energy import holding_powers, long_wait_powers
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class TimedBoundSettings:
    """Settings of the bound; any values give a valid bound."""

    second_price: float = 0.95
    """Second price over minus the power of electronics and inverters [1]: at 1, the bounds of moves
    hardly depend on their duration, and take the longest one."""


TIMED_BOUND = TimedBoundSettings()


@dataclass(frozen=True)
class TimedBound:
    """Lower bounds of the cycles in a given time.

    Attributes:
        cycle: the cycle.
        legs: its legs.
        time: duration of the cycle without dwells [s].
        longest: longest duration of a move [s].
    """

    cycle: Cycle
    legs: Sequence[Leg]
    time: float
    longest: float

    def at(self, price: float, known: float) -> float:
        """Lower bound of all cycles in the given time [J].

        At a negative price it also holds for every longer time, at a positive one for every shorter
        time.

        Args:
            price: price of time [W].
            known: objective of a known cycle [J]; the bound does not exceed it.

        Returns:
            The bound; -inf if some configurations are not known.
        """
        if not all(leg.closed for leg in self.legs):
            return -np.inf
        arm, longest = self.cycle.arm, self._longest_below(known)
        prices = {price}
        if price < 0:
            power = arm.base_power + float(arm.drives.inverter_constant.sum())
            prices.add(-TIMED_BOUND.second_price * power)
        # waiting must not pay
        prices = {max(each, -self._least_waiting_power()) for each in prices}
        return min(max(self._least(each, longest) - each * self.time for each in prices), known)

    @property
    def _rests_count(self) -> bool:
        """Whether the energy at rest is part of the objective."""
        return self.cycle.objective == "electrical"

    def _least_waiting_power(self) -> float:
        """Least increase of the objective by a second of waiting [W], on motors or on brakes."""
        if not self._rests_count:
            return 0.0
        return min(
            float(power.min())
            for move, leg in zip(self.cycle.moves, self.legs, strict=True)
            for power in (
                holding_powers(move, leg.goal),
                long_wait_powers(self.cycle, move, leg.goal),
            )
        )

    def _longest_below(self, known: float) -> float:
        """Longest duration [s] of a move in any cycle that needs less than `known` [J].

        Every second draws at least the base power P of the electronics, so a cycle with a move of
        duration T needs at least P T more than the least chain of Σ (E - P T).
        """
        longest = self.cycle.longest_move
        base = self.cycle.arm.base_power if self._rests_count else 0.0
        if longest <= self.longest or base <= 0:
            return longest
        beside = self._least(-base, longest)
        return float(np.clip((known - beside) / base, DURATIONS.least, longest))

    def _least(self, price: float, longest: float) -> float:
        """Least sum [J] of the bounds on energy + price · duration over all chains.

        Args:
            price: price of time [W].
            longest: longest duration of a move [s].
        """
        costs = [leg.priced(price, longest).least_costs for leg in self.legs]
        return LeastChain(costs, self.cycle.closed).find()[0]
