"""Scheduling of the pruning of answers, which reads the sizes of all answers."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class PruningSettings:
    """Settings of the pruning of answers."""

    parts: int = 64
    """Reciprocal of the share freed by a pruning, after whose addition the next one follows."""
    longest: float = 3600.0
    """Longest time [s] between two prunings: answers also grow old."""


PRUNING = PruningSettings()


class Pruning:
    """Counts the bytes added since the last pruning; `clock` [s]. It is thread-safe."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._added = 0
        self._next: float | None = None

    def due(self, added: int, most: int) -> bool:
        """Whether to prune after `added` more bytes, of at most `most`; counts as done if true."""
        with self._lock:
            self._added += added
            if (
                self._next is not None
                and self._clock() < self._next
                and self._added <= most // PRUNING.parts
            ):
                return False
            self._added, self._next = 0, self._clock() + PRUNING.longest
            return True

    def failed(self) -> None:
        """Makes the next pruning due at once, after a failure."""
        with self._lock:
            self._next = None

    @staticmethod
    def target(most: int) -> int:
        """Total after a pruning [byte], so that it stays below `most` until the next one."""
        return most - most // PRUNING.parts
