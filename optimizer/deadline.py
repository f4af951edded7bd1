"""Deadline of a computation: an instant of a clock, at which it ends with the best result so far."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

Clock = Callable[[], float]


@dataclass(frozen=True)
class Deadline:
    """The instant `at` [s] of `clock`, a function that returns the time [s]; a test may pass its own."""

    at: float = math.inf
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float, clock: Clock = time.perf_counter) -> Deadline:
        """The deadline `seconds` [s] from now."""
        return cls(clock() + seconds, clock)

    @property
    def left(self) -> float:
        """Time until the deadline [s], negative after it."""
        return self.at - self.clock()

    @property
    def passed(self) -> bool:
        """Whether the deadline is in the past."""
        return self.left < 0

    def within(self, seconds: float) -> Deadline:
        """The earlier of this deadline and the one `seconds` [s] from now."""
        return replace(self, at=min(self.at, self.clock() + seconds))


NEVER = Deadline()
