"""The listener of the task in this process, which receives its events before its result."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from joulepath.optimizer.progress import Tell, no_listener

_tell: ContextVar[Tell] = ContextVar("tell", default=no_listener)


@contextmanager
def listening(tell: Tell) -> Iterator[None]:
    """A context in which `tell` receives the events of tasks."""
    before = _tell.set(tell)
    try:
        yield
    finally:
        _tell.reset(before)


def listener() -> Tell:
    """The listener of the running task."""
    return _tell.get()
