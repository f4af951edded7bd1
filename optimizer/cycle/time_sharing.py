"""The time of a cycle, shared among the moves of one chain so that its energy is least.

At a price of time, every move takes the duration at which one more second saves just that price.
The price at which the durations add up to the time there is shares it best. Waiting has a price,
too: what it draws. Time is waited out only where every move saves less by a further second than
waiting costs, or hardly more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

# W: prices of time that are tried where it is short; at the last, motions are nearly as fast as
# they can be
PRICES = (20.0, 100.0, 500.0, 2500.0)
# relative: a slower move must save more than a wait draws by this share, or else the time is waited
# out
WORTH_SLOWING = 2e-3
# relative: no further price is tried where sharing the time better saves no more energy than
# SHARED, and the durations at one price add up to the time but for NEAR, or two prices differ by
# SETTLED at most
SHARED, NEAR, SETTLED = 1e-4, 1e-3, 1e-2
# prices that are tried at most
MOST_PRICES = 14
# W: a second that saves less mechanical work than this is waited out; and factor from one price to
# the next
LEAST_PRICE, STEP = 1e-3, 6.0


class Motion(Protocol):
    """A motion, of which only duration and objective count."""

    @property
    def duration(self) -> float:
        """Its duration [s]."""
        ...

    @property
    def energy(self) -> float:
        """Its objective [J]."""
        ...


class PricedMove(Protocol):
    """A move between two rests."""

    def at(self, price: float) -> Motion:
        """Its motion of least energy + price · duration. Raises NoTrajectory, or
        DeadlineExceeded."""
        ...


@dataclass(frozen=True)
class Shared:
    """Durations `lengths` [s] of the moves, which need `energy` [J], nearly; the rest of the time
    is `waited` [s].

    One more second would save `price` [W]. By duality at prices of time, this chain needs `least`
    [J] or more in this time, the wait included; the motions at these prices are local optima.
    """

    price: float
    lengths: list[float]
    energy: float
    waited: float = 0.0
    least: float = -np.inf

    @classmethod
    def of(cls, price: float, motions: Sequence[Motion]) -> Shared:
        """The durations and energies of motions."""
        return cls(price, [each.duration for each in motions], energy_of(motions))

    @property
    def moving(self) -> float:
        """Duration [s] of all moves."""
        return sum(self.lengths)

    def tangent(self, time: float) -> float:
        """What the moves of this chain need at least [J] in another time [s], if these are the best
        at the price.
        """
        return self.energy - self.price * (time - self.moving)


class TimeSharing:
    """The moves of one chain at several prices of time."""

    def __init__(self, moves: Sequence[PricedMove]) -> None:
        self.moves = moves

    def at(self, price: float) -> Shared:
        """The moves at a price [W]. Raises NoTrajectory, or DeadlineExceeded."""
        return Shared.of(price, [move.at(price) for move in self.moves])

    def fill(self, time: float, waiting: float, fastest: Sequence[Motion]) -> Shared:
        """The moves that need the least energy with a wait that draws `waiting` [W], in exactly
        `time` [s].

        `fastest` are the moves as fast as they can be, in no more than this time. Raises
        NoTrajectory, or DeadlineExceeded.
        """
        slow = self.at(-waiting * (1 - WORTH_SLOWING))
        if slow.moving <= time:
            return Shared(
                -waiting, slow.lengths, slow.energy, time - slow.moving, slow.tangent(time)
            )
        for price in PRICES:
            fast = self.at(price)
            if fast.moving <= time:
                return self._between(slow, fast, time)
            slow = fast
        # the fastest moves are the best at no price: only the slow ones have a tangent
        return replace(_mixed(slow, Shared.of(PRICES[-1], fastest), time), least=slow.tangent(time))

    def fill_for_work(self, time: float, fastest: Sequence[Motion]) -> Shared:
        """The moves that do the least mechanical work within `time` [s], as in `fill`: rests do
        none, and every second more saves work, but less and less.

        The work of acceleration falls with the square of the duration: by this, the first price is
        guessed.
        """
        fast = Shared.of(PRICES[-1], fastest)
        price = np.clip(
            2 * fast.energy / fast.moving * (fast.moving / time) ** 3, LEAST_PRICE, PRICES[-1]
        )
        found = self.at(float(price))
        if found.moving <= time:
            while found.moving <= time:
                if found.price <= LEAST_PRICE:
                    return Shared(
                        0.0, found.lengths, found.energy, time - found.moving, found.energy
                    )
                fast, found = found, self.at(max(found.price / STEP, LEAST_PRICE))
            return self._between(found, fast, time)
        while found.price < PRICES[-1]:
            slow, found = found, self.at(min(found.price * STEP, PRICES[-1]))
            if found.moving <= time:
                return self._between(slow, found, time)
        return _mixed(found, fast, time)

    def _between(self, slow: Shared, fast: Shared, time: float) -> Shared:
        """The moves at a price between two, one of which is too slow: by the Illinois method."""
        above, below = slow.moving - time, fast.moving - time
        for _ in range(MOST_PRICES):
            mixed = _mixed(slow, fast, time)
            settled = min(above, -below) <= NEAR * time or slow.price >= fast.price - SETTLED * abs(
                fast.price
            )
            if settled and mixed.energy - mixed.least <= SHARED * abs(mixed.energy):
                return replace(mixed, price=(slow if above < -below else fast).price)
            middle = self.at(fast.price - below * (slow.price - fast.price) / (above - below))
            if middle.moving > time:
                slow, above, below = middle, middle.moving - time, below / 2
            else:
                fast, below, above = middle, middle.moving - time, above / 2
        return _mixed(slow, fast, time)


def duration_of(motions: Sequence[Motion]) -> float:
    """Duration [s] of motions one after the other."""
    return sum(each.duration for each in motions)


def energy_of(motions: Sequence[Motion]) -> float:
    """Energy [J] of motions."""
    return sum(each.energy for each in motions)


def _mixed(slow: Shared, fast: Shared, time: float) -> Shared:
    """Durations between those of two, so that they add up to the time; the energy is that of the
    chord, an estimate.
    """
    share = (time - fast.moving) / (slow.moving - fast.moving)
    lengths = [a + share * (b - a) for a, b in zip(fast.lengths, slow.lengths, strict=True)]
    price = (fast.energy - slow.energy) / (slow.moving - fast.moving)
    least = max(slow.tangent(time), fast.tangent(time))
    return Shared(price, lengths, fast.energy + share * (slow.energy - fast.energy), least=least)
