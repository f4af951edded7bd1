"""Allocation of the time of a cycle among the moves of one chain, for least energy.

At a price of time [W], the Lagrange multiplier of the total duration, every move takes the duration
at which a further second saves just this price. The price at which the durations add up to the
available time gives the best allocation. Waiting has a price too, its power. Time is waited out
only if a further second saves less than waiting costs, or hardly more, for every move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class TimeAllocationSettings:
    """Settings of the allocation of time."""

    prices: tuple[float, ...] = (20.0, 100.0, 500.0, 2500.0)
    """Prices of time tried where time is short [W]; at the last one, motions are nearly as fast as
    possible."""
    worth_slowing: float = 2e-3
    """Relative saving over a wait by which slower moves must be better than waiting."""
    duality_gap: float = 1e-4
    """Relative duality gap at which no further price is tried."""
    near_time: float = 1e-3
    """Relative difference of the total duration from the time at which a price is near enough."""
    near_price: float = 1e-2
    """Relative difference of two prices at which they are near enough."""
    most_prices: int = 14
    """Most prices tried."""
    least_price: float = 1e-3
    """Saving of mechanical work by a second below which the rest of the time is waited out [W]."""
    price_factor: float = 6.0
    """Factor from one price to the next for mechanical work."""


ALLOCATION = TimeAllocationSettings()


class Motion(Protocol):
    """A motion with its duration and objective."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        ...

    @property
    def energy(self) -> float:
        """Objective [J]."""
        ...


PricedMove = Callable[[float], Motion]
"""A move between two rests: its motion of least energy + price · duration, by the price [W]. Raises
NoTrajectory without a motion, and DeadlineExceeded if the time is up."""


@dataclass(frozen=True)
class Allocation:
    """Durations of the moves of one chain.

    Attributes:
        price: saving by a further second [W].
        durations: durations of the moves [s].
        energy: objective of the moves, nearly [J].
        waited: remaining time [s].
        least: lower bound of the objective of this chain in this time with the wait [J], by
            duality; the motions at the prices are local optima.
    """

    price: float
    durations: list[float]
    energy: float
    waited: float = 0.0
    least: float = -np.inf

    @classmethod
    def of(cls, price: float, motions: Sequence[Motion]) -> Allocation:
        """Durations and energies of given motions."""
        return cls(price, [each.duration for each in motions], total_energy(motions))

    @property
    def moving_time(self) -> float:
        """Duration of all moves [s]."""
        return sum(self.durations)

    def tangent(self, time: float) -> float:
        """Lower bound [J] of the chain in another time [s], if its motions are optimal at the
        price.
        """
        return self.energy - self.price * (time - self.moving_time)


class TimeAllocation:
    """The moves of one chain at several prices of time."""

    def __init__(self, moves: Sequence[PricedMove]) -> None:
        self.moves = moves

    def at(self, price: float) -> Allocation:
        """The moves at a price [W].

        Raises:
            NoTrajectory: a move has no motion.
            DeadlineExceeded: the time is up.
        """
        return Allocation.of(price, [move(price) for move in self.moves])

    def allocate(self, time: float, waiting: float, fastest: Sequence[Motion]) -> Allocation:
        """Moves and a wait of least energy, in exactly the given time.

        Mechanical work needs no power for a wait. Every further second then saves work, but less
        and less, and the rest of the time is waited out below `least_price`.

        Args:
            time: total time [s].
            waiting: power of waiting [W].
            fastest: fastest motions of all moves, together no longer than the time.

        Raises:
            NoTrajectory: a move has no motion.
            DeadlineExceeded: the time is up.
        """
        lowest = -waiting * (1 - ALLOCATION.worth_slowing) if waiting else ALLOCATION.least_price
        found = self.at(lowest if waiting else _first_price(fastest, time))
        while found.moving_time <= time:
            if found.price <= lowest:
                waited, least = time - found.moving_time, found.tangent(time)
                return Allocation(0.0 - waiting, found.durations, found.energy, waited, least)
            fast, found = found, self.at(max(found.price / ALLOCATION.price_factor, lowest))
            if found.moving_time > time:
                return self._between_prices(found, fast, time)
        for price in ALLOCATION.prices:
            if price > found.price:
                slow, found = found, self.at(price)
                if found.moving_time <= time:
                    return self._between_prices(slow, found, time)
        # the fastest moves are optimal at no price, so only the slow ones give a tangent
        return replace(
            _interpolated(found, Allocation.of(ALLOCATION.prices[-1], fastest), time),
            least=found.tangent(time),
        )

    def _between_prices(self, slow: Allocation, fast: Allocation, time: float) -> Allocation:
        """Moves at a price between those of too slow and fast enough moves, by the Illinois
        method.
        """
        above, below = slow.moving_time - time, fast.moving_time - time
        for _ in range(ALLOCATION.most_prices):
            interpolated = _interpolated(slow, fast, time)
            settled = (
                min(above, -below) <= ALLOCATION.near_time * time
                or slow.price >= fast.price - ALLOCATION.near_price * abs(fast.price)
            )
            if settled and interpolated.energy - interpolated.least <= ALLOCATION.duality_gap * abs(
                interpolated.energy
            ):
                return replace(interpolated, price=(slow if above < -below else fast).price)
            middle = self.at(fast.price - below * (slow.price - fast.price) / (above - below))
            if middle.moving_time > time:
                slow, above, below = middle, middle.moving_time - time, below / 2
            else:
                fast, below, above = middle, middle.moving_time - time, above / 2
        return _interpolated(slow, fast, time)


def _first_price(fastest: Sequence[Motion], time: float) -> float:
    """Price [W] near that of the given time [s] for work alone: the work of acceleration is
    proportional to the inverse square of the duration.
    """
    energy, shortest = total_energy(fastest), total_duration(fastest)
    price = 2 * energy * shortest**2 / time**3
    return float(np.clip(price, ALLOCATION.least_price, ALLOCATION.prices[-1]))


def total_duration(motions: Sequence[Motion]) -> float:
    """Duration [s] of motions one after the other."""
    return sum(each.duration for each in motions)


def total_energy(motions: Sequence[Motion]) -> float:
    """Energy [J] of motions."""
    return sum(each.energy for each in motions)


def _interpolated(slow: Allocation, fast: Allocation, time: float) -> Allocation:
    """Durations between two allocations that add up to the time; the energy of the chord is an
    estimate.
    """
    ratio = (time - fast.moving_time) / (slow.moving_time - fast.moving_time)
    durations = [a + ratio * (b - a) for a, b in zip(fast.durations, slow.durations, strict=True)]
    price = (fast.energy - slow.energy) / (slow.moving_time - fast.moving_time)
    least = max(slow.tangent(time), fast.tangent(time))
    return Allocation(
        price, durations, fast.energy + ratio * (slow.energy - fast.energy), least=least
    )
