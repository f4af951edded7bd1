"""Deadlines of computations: an instant of a clock at which they end with their best result so far.

A loop with a useful partial result reads `Deadline.passed`. Work below such loops may take long and
is useless in part, such as torques at a million instants, distances of a thousand pairs, or a
quadratic program. It calls `checkpoint`, which raises DeadlinePassed once a deadline watched by a
caller has passed.

A computation without further use ends at its next `checkpoint` too; see `stoppable`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass, replace

from joulepath.optimizer.context_value import assigned

Clock = Callable[[], float]


@dataclass(frozen=True)
class Deadline:
    """The instant `at` [s] of `clock`, a function that returns the time [s]."""

    at: float = math.inf
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float, clock: Clock = time.perf_counter) -> Deadline:
        """The deadline `seconds` [s] from now."""
        return cls(clock() + seconds, clock)

    @property
    def left(self) -> float:
        """Time until the deadline [s]; negative after it, and for a stopped computation."""
        return min(self.at - self.clock(), -LONG_PAST) if is_stopped() else self.at - self.clock()

    @property
    def passed(self) -> bool:
        """Whether the deadline is in the past."""
        return self.left < 0

    def within(self, seconds: float) -> Deadline:
        """The earlier one of this deadline and `seconds` [s] from now."""
        return replace(self, at=min(self.at, self.clock() + seconds))

    def earlier_by(self, seconds: float) -> Deadline:
        """The deadline `seconds` [s] before this one, or after it if negative."""
        return replace(self, at=self.at - seconds)


NEVER = Deadline()


class DeadlineShares:
    """Divides the time until a deadline among successive runs.

    A run gets the time left divided by the number of remaining runs, so later runs profit from time
    left over.

    Args:
        deadline: instant at which the last run must end.
        runs: number of runs.
        least: shortest share [s]; a run without time left reports this itself.
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
"""Time since every deadline of a stopped computation [s]; finite, for finite shares of it."""


class Stopped(BaseException):
    """The result of the computation is no longer of use.

    Handlers of errors let it pass; the caller that runs the computation catches it.
    """


_stop_condition: ContextVar[Callable[[], bool] | None] = ContextVar(
    "whether the computation is stopped", default=None
)


def stoppable(is_stopped: Callable[[], bool]) -> AbstractContextManager[None]:
    """Context in which a computation can be stopped.

    Once `is_stopped` returns True, every deadline has passed and `checkpoint` raises Stopped. The
    function is called often, must be fast, and must never return to False.
    """
    return assigned(_stop_condition, is_stopped)


def is_stopped() -> bool:
    """Whether the computation is stopped."""
    stopped = _stop_condition.get()
    return stopped is not None and stopped()


def end_if_stopped() -> None:
    """End a stopped computation, for work without a deadline.

    Raises:
        Stopped: the computation is stopped.
    """
    if is_stopped():
        raise Stopped


class DeadlinePassed(Exception):
    """The watched deadline has passed; caught by the caller that watches it."""


_watched: ContextVar[Deadline | None] = ContextVar("watched deadline", default=None)


def watch(deadline: Deadline) -> AbstractContextManager[None]:
    """Context in which `checkpoint` raises DeadlinePassed after `deadline`.

    Of nested contexts the innermost one counts. Every thread watches its own deadline.
    """
    return assigned(_watched, deadline)


def checkpoint(needed: float = 0.0) -> None:
    """End the computation if it is stopped or out of time.

    Args:
        needed: time needed before the watched deadline [s].

    Raises:
        Stopped: the computation is stopped.
        DeadlinePassed: less than `needed` is left.
    """
    end_if_stopped()
    deadline = _watched.get()
    if deadline is not None and deadline.left < needed:
        raise DeadlinePassed


def watched_time_left() -> float:
    """Time until the watched deadline [s]; infinite without one."""
    deadline = _watched.get()
    return math.inf if deadline is None else deadline.left
