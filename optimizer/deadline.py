"""Deadline of a computation: an instant of a clock, at which it ends with the best result so far.

A loop that can return what it has so far reads `Deadline.passed`. Below such loops lies work that may take long by
itself and is of no use in part: torques at a million instants, distances of a thousand pairs, a quadratic program. It
calls `checkpoint`, which raises DeadlinePassed once the deadline has passed that a caller further up watches.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
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

    def earlier_by(self, seconds: float) -> Deadline:
        """The deadline `seconds` [s] before this one; after it, if they are negative."""
        return replace(self, at=self.at - seconds)


NEVER = Deadline()


class DeadlinePassed(Exception):
    """The watched deadline has passed. Whoever watches it catches this."""


_watched: ContextVar[Deadline | None] = ContextVar("watched deadline", default=None)


@contextmanager
def watch(deadline: Deadline) -> Iterator[None]:
    """Within the context, `checkpoint` raises DeadlinePassed after `deadline`. Of nested contexts the innermost counts.

    Each thread watches its own.
    """
    before = _watched.set(deadline)
    try:
        yield
    finally:
        _watched.reset(before)


def checkpoint(needed: float = 0.0) -> None:
    """Raises DeadlinePassed if less than `needed` [s] is left until the watched deadline; without one, does nothing."""
    deadline = _watched.get()
    if deadline is not None and deadline.left < needed:
        raise DeadlinePassed


def watched_time_left() -> float:
    """Time until the watched deadline [s]; infinite without one."""
    deadline = _watched.get()
    return math.inf if deadline is None else deadline.left
