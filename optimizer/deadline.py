"""Deadline of a computation: an instant of a clock, at which it ends with the best result so far.

A loop that can return what it has so far reads `Deadline.passed`. Below such loops lies work that
may take long by itself and is of no use in part: torques at a million instants, distances of a
thousand pairs, a quadratic program. It calls `checkpoint`, which raises DeadlinePassed once the
deadline has passed that a caller further up watches.

A computation whose result nobody wants any more ends at its next `checkpoint`, too: see
`stoppable`.
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
    """The instant `at` [s] of `clock`, a function that returns the time [s]; a test may pass its
    own.
    """

    at: float = math.inf
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float, clock: Clock = time.perf_counter) -> Deadline:
        """The deadline `seconds` [s] from now."""
        return cls(clock() + seconds, clock)

    @property
    def left(self) -> float:
        """Time until the deadline [s], negative after it, and once the computation is stopped."""
        return min(self.at - self.clock(), -LONG_PAST) if is_stopped() else self.at - self.clock()

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


class DeadlineShares:
    """Divides the time until a deadline among runs that follow one another.

    A run gets the time left divided by the number of runs left, so that the later runs get the time
    that it does not use.

    Args:
        deadline: instant at which the last run must end.
        runs: number of runs.
        least: shortest share [s]; a run whose time was used up by earlier ones still says so
            itself.
    """

    def __init__(self, deadline: Deadline, runs: int, least: float = 1e-3) -> None:
        self._deadline, self._runs, self._least = deadline, runs, least

    @property
    def used_up(self) -> bool:
        """Whether no time is left."""
        return self._deadline.passed

    def next(self) -> float:
        """Time for the next run [s]."""
        share = self._deadline.left / self._runs
        self._runs -= 1
        return max(share, self._least)


LONG_PAST = 1e6
"""Time [s] by which every deadline has passed for a computation that is stopped. It is finite, so
that shares of it are numbers."""


class Stopped(BaseException):
    """Nobody wants the result of the computation. Handlers of errors let it pass: whoever runs the
    computation catches it."""


_wanted_no_more: ContextVar[Callable[[], bool] | None] = ContextVar(
    "whether the computation is stopped", default=None
)


@contextmanager
def stoppable(is_stopped: Callable[[], bool]) -> Iterator[None]:
    """Within the context, once `is_stopped` says so, every deadline has passed, and `checkpoint`
    raises Stopped.

    `is_stopped` is called often, must be fast, and must never take back that it is so.
    """
    before = _wanted_no_more.set(is_stopped)
    try:
        yield
    finally:
        _wanted_no_more.reset(before)


def is_stopped() -> bool:
    """Whether nobody wants the result of this computation."""
    stopped = _wanted_no_more.get()
    return stopped is not None and stopped()


def end_if_stopped() -> None:
    """Raises Stopped if the computation is stopped: for work that must be finished whatever the
    deadline.
    """
    if is_stopped():
        raise Stopped


class DeadlinePassed(Exception):
    """The watched deadline has passed. Whoever watches it catches this."""


_watched: ContextVar[Deadline | None] = ContextVar("watched deadline", default=None)


@contextmanager
def watch(deadline: Deadline) -> Iterator[None]:
    """Within the context, `checkpoint` raises DeadlinePassed after `deadline`. Of nested contexts
    the innermost counts.

    Each thread watches its own.
    """
    before = _watched.set(deadline)
    try:
        yield
    finally:
        _watched.reset(before)


def checkpoint(needed: float = 0.0) -> None:
    """Raises Stopped if the computation is stopped, and DeadlinePassed if less than `needed` [s] is
    left until the watched deadline, if there is one."""
    end_if_stopped()
    deadline = _watched.get()
    if deadline is not None and deadline.left < needed:
        raise DeadlinePassed


def watched_time_left() -> float:
    """Time until the watched deadline [s]; infinite without one."""
    deadline = _watched.get()
    return math.inf if deadline is None else deadline.left
