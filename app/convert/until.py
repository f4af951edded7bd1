"""The deadline of what is read from a request before anything is computed: mesh files, URDFs,
logs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded

_LEAST_TIME = 1e-3
"""Shortest time of a computation [s]: one whose time was used up by the reading still says so by
itself.
"""


@contextmanager
def until(end: Deadline) -> Iterator[None]:
    """Within the context, `checkpoint` ends what is read once `end` has passed. Raises
    DeadlineExceeded then.
    """
    try:
        with watch(end):
            yield
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


def time_left(end: Deadline) -> float:
    """The time [s] that is left for a computation, never zero."""
    return max(end.left, _LEAST_TIME)
