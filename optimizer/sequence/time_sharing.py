"""The time of a round, shared among the moves of one chain so that its energy is least.

At a price of time, every move takes the duration at which one more second saves just that price. The price at which the
durations add up to the time there is shares it best. Waiting has a price, too: what it draws. Time is waited out only
where every move saves less by a further second than waiting costs, or hardly more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from optimizer.deadline import Deadline
from optimizer.exceptions import DeadlineExceeded, NoTrajectory
from optimizer.sequence.legs import Leg
from optimizer.sequence.priced_search import PricedMotion, fastest_motion, priced_motion
from optimizer.trajectories.spline import Spline

# W: prices of time that are tried where it is short; at the last, motions are nearly as fast as they can be
PRICES = (20.0, 100.0, 500.0, 2500.0)
# share of the price of waiting that a slower move must save more than: to creep is no better than to wait
CREEPING = 2e-3
# relative: durations that add up to the time within this are stretched by the rest; and most prices tried
SHARED, MOST_PRICES = 1e-3, 14


@dataclass(frozen=True)
class Shared:
    """Durations `lengths` [s] of the moves, which need `energy` [J], nearly; the rest of the time is `waited` [s].

    One more second would save `price` [W]. `exact`: at this price they are the best of this chain.
    """

    price: float
    lengths: list[float]
    energy: float
    waited: float = 0.0
    exact: bool = True

    @classmethod
    def of(cls, price: float, motions: Sequence[PricedMotion]) -> Shared:
        """The durations and energies of motions."""
        return cls(price, [each.duration for each in motions], sum(each.energy for each in motions))

    @property
    def moving(self) -> float:
        """Duration [s] of all moves."""
        return sum(self.lengths)


class TimeSharing:
    """The motions of one chain at several prices of time; `pairs` are leg, start node and goal node of each move."""

    def __init__(
        self,
        legs: Sequence[Leg],
        pairs: Sequence[tuple[int, int, int]],
        guesses: Sequence[Spline | None],
        longest: float,
        deadline: Deadline,
    ) -> None:
        self.legs, self.pairs, self.longest, self.deadline = legs, pairs, longest, deadline
        self.guesses = list(guesses)

    def at(self, price: float) -> Shared:
        """The moves at a price [W]. Raises NoTrajectory, or DeadlineExceeded."""
        motions = []
        for (k, s, g), guess in zip(self.pairs, self.guesses, strict=True):
            found = priced_motion(self.legs[k], s, g, price, self.longest, self.deadline, guess)
            if found is None and guess is not None:
                found = priced_motion(self.legs[k], s, g, price, self.longest, self.deadline)
            motions.append(self._checked(found))
        self.guesses = [motion.spline for motion in motions]
        return Shared.of(price, motions)

    def fastest(self) -> Shared:
        """The moves as fast as they can be. Raises NoTrajectory, or DeadlineExceeded."""
        motions = [self._checked(fastest_motion(self.legs[k], s, g, self.deadline)) for k, s, g in self.pairs]
        return Shared.of(PRICES[-1], motions)

    def fill(self, time: float, waiting: float) -> Shared:
        """The moves that need the least energy with a wait that draws `waiting` [W], in exactly `time` [s].

        Raises NoTrajectory if the moves cannot be that fast, or DeadlineExceeded.
        """
        slow = self.at(-waiting * (1 - CREEPING))
        if slow.moving <= time:
            return Shared(-waiting, slow.lengths, slow.energy, time - slow.moving)
        for price in PRICES:
            fast = self.at(price)
            if fast.moving <= time:
                return self._between(slow, fast, time)
            slow = fast
        fast = self.fastest()
        if fast.moving > time:
            raise NoTrajectory([])
        return _mixed(slow, fast, time)

    def _between(self, slow: Shared, fast: Shared, time: float) -> Shared:
        """The moves at a price between two, one of which is too slow: by the Illinois method."""
        above, below = slow.moving - time, fast.moving - time
        for _ in range(MOST_PRICES):
            if -(fast.moving - time) <= SHARED * time:
                stretch = time / fast.moving
                return Shared(fast.price, [length * stretch for length in fast.lengths], fast.energy)
            middle = self.at(fast.price - below * (slow.price - fast.price) / (above - below))
            if middle.moving > time:
                slow, above, below = middle, middle.moving - time, below / 2
            else:
                fast, below, above = middle, middle.moving - time, above / 2
        # the durations jump at some price
        return _mixed(slow, fast, time)

    def _checked(self, found: PricedMotion | None) -> PricedMotion:
        if found is None:
            raise DeadlineExceeded([]) if self.deadline.passed else NoTrajectory([])
        return found


def _mixed(slow: Shared, fast: Shared, time: float) -> Shared:
    """Durations between those of two, so that they add up to the time; energies are convex, and not above the chord."""
    share = (time - fast.moving) / (slow.moving - fast.moving)
    lengths = [a + share * (b - a) for a, b in zip(fast.lengths, slow.lengths, strict=True)]
    price = (fast.energy - slow.energy) / (slow.moving - fast.moving)
    return Shared(price, lengths, fast.energy + share * (slow.energy - fast.energy), exact=False)
