"""When work ends with the best result found so far: an instant of a clock that tests may move by hand."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

Clock = Callable[[], float]


@dataclass(frozen=True)
class Deadline:
    """The instant `at` [s] of `clock`."""

    at: float = math.inf
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float, clock: Clock = time.perf_counter) -> Deadline:
        """The deadline that many seconds from now."""
        return cls(clock() + seconds, clock)

    @property
    def left(self) -> float:
        """Time until then [s]; negative once it has passed."""
        return self.at - self.clock()

    @property
    def passed(self) -> bool:
        """Whether that instant lies in the past."""
        return self.left < 0

    def within(self, seconds: float) -> Deadline:
        """This deadline, or the one that many seconds from now if that is earlier."""
        return replace(self, at=min(self.at, self.clock() + seconds))


NEVER = Deadline()
