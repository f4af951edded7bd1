"""When stored answers are to be pruned: not with every new one, since that reads the sizes of
all."""

from __future__ import annotations

import threading
from collections.abc import Callable

_PARTS = 64
"""Pruning leaves one part of this many free, and comes again when that much was added."""
_LONGEST = 3600.0
"""Longest time [s] between two prunings: answers also grow old."""


class Pruning:
    """Counts what is added since the last pruning; `clock` [s]. Safe for use by several threads."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._added = 0
        self._next: float | None = None

    def due(self, added: int, most: int) -> bool:
        """Whether to prune now that `added` bytes more are stored, of at most `most`. It is then
        counted as done.
        """
        with self._lock:
            self._added += added
            if (
                self._next is not None
                and self._clock() < self._next
                and self._added <= most // _PARTS
            ):
                return False
            self._added, self._next = 0, self._clock() + _LONGEST
            return True

    def failed(self) -> None:
        """The pruning that was due was not done: the next one is due at once."""
        with self._lock:
            self._next = None

    @staticmethod
    def target(most: int) -> int:
        """What a pruning leaves [byte], so that the total stays below `most` until the next one."""
        return most - most // _PARTS
