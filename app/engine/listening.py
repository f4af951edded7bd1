"""The listener of the task in this process, which receives its events before its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from joulepath.optimizer.progress import no_listener

Listener = Callable[[Any], None]
"""Gets the events of a search, or the steps of another computation."""
_tell: ContextVar[Listener] = ContextVar("tell", default=no_listener)


@contextmanager
def listening(tell: Listener) -> Iterator[None]:
    """A context in which `tell` receives the events of tasks."""
    before = _tell.set(tell)
    try:
        yield
    finally:
        _tell.reset(before)


def listener() -> Listener:
    """The listener of the running task."""
    return _tell.get()
