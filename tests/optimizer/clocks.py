"""Clocks that a test moves by itself: what hangs on a deadline does not hang on the machine."""

from __future__ import annotations

# readings of the clock that a search needs at most to end once its deadline has passed: every stage
# looks at it once, and a front does so in each of its searches
LAST_READINGS = 40


class CountingClock:
    """Stands still but for each reading, which moves it on by `tick` [s]."""

    def __init__(self, tick: float = 1.0) -> None:
        self.now, self.tick = 0.0, tick

    def __call__(self) -> float:
        self.now += self.tick
        return self.now


def still() -> float:
    """A clock that stands still: no deadline ever passes."""
    return 0.0
