"""Who waits for a worker, and how many work: what operators watch and scale by."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Census:
    """Counts of an engine. `clock` [s] tells ages."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: dict[object, float] = {}
        self.busy = 0
        """Workers that run a task."""
        self.restarts = 0
        """Workers that had to be replaced since the start: they were killed, or ended by themselves."""

    @property
    def waiting(self) -> int:
        """Tasks that wait for a worker."""
        return len(self._waiting)

    @property
    def oldest(self) -> float:
        """Time [s] for which the oldest of them has waited; 0 if none waits."""
        return max(0.0, self._clock() - min(self._waiting.values(), default=self._clock()))

    @contextmanager
    def waits(self) -> Iterator[None]:
        """A context in which a task waits."""
        entry = object()
        self._waiting[entry] = self._clock()
        try:
            yield
        finally:
            del self._waiting[entry]

    @contextmanager
    def works(self) -> Iterator[None]:
        """A context in which a worker runs a task."""
        self.busy += 1
        try:
            yield
        finally:
            self.busy -= 1
