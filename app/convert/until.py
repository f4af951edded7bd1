"""Deadline for reading the mesh files, URDFs and logs of a request."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded

_LEAST_TIME = 1e-3
"""Shortest time of a computation [s]. After a slow read, the computation reports the deadline."""


@contextmanager
def until(end: Deadline) -> Iterator[None]:
    """A context whose calls of `checkpoint` stop the reading after `end`.

    Raises:
        DeadlineExceeded: the deadline passed.
    """
    try:
        with watch(end):
            yield
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


def time_left(end: Deadline) -> float:
    """The time left for a computation [s], never zero."""
    return max(end.left, _LEAST_TIME)
