"""Clocks controlled by a test: deadlines do not depend on the speed of the machine."""

from __future__ import annotations

# largest number of readings of the clock after the deadline: every stage of a search reads it once,
# and a front does so in all of its searches
LAST_READINGS = 40


class CountingClock:
    """A clock that advances only when read, by `tick` [s]."""

    def __init__(self, tick: float = 1.0) -> None:
        self.now, self.tick = 0.0, tick

    def __call__(self) -> float:
        self.now += self.tick
        return self.now


def still() -> float:
    """A clock that stands still: no deadline ever passes."""
    return 0.0
