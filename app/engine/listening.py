"""Who listens to the task that this process runs: what the task finds goes there at once, before
its result.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from joulepath.optimizer.progress import Tell, no_listener

_tell: ContextVar[Tell] = ContextVar("tell", default=no_listener)


@contextmanager
def listening(tell: Tell) -> Iterator[None]:
    """A context in which `tell` gets what tasks find."""
    before = _tell.set(tell)
    try:
        yield
    finally:
        _tell.reset(before)


def listener() -> Tell:
    """What gets the events of this task."""
    return _tell.get()
