"""One deadline for several runs."""

from __future__ import annotations

from joulepath.optimizer.deadline import Deadline

LEAST_SHARE = 1e-3
"""Shortest share [s]: a run whose time was used up by earlier runs still reports that by itself."""


class DeadlineShares:
    """Divides the time until a deadline among `runs` runs, one after another.

    A run gets the time left divided by the number of runs left, so that the time that it does not use is for the later
    ones.
    """

    def __init__(self, deadline: Deadline, runs: int) -> None:
        self._deadline, self._runs = deadline, runs

    @property
    def used_up(self) -> bool:
        """Whether no time is left."""
        return self._deadline.passed

    def next(self) -> float:
        """Time [s] for the next run."""
        share = self._deadline.left / self._runs
        self._runs -= 1
        return max(share, LEAST_SHARE)
