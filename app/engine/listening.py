"""The listener of the running task in this process: it receives events before the result."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from contextvars import ContextVar
from typing import Any

from joulepath.optimizer.context_value import assigned
from joulepath.optimizer.progress import no_listener

Listener = Callable[[Any], None]
"""Receives the events of a search, or the steps of another computation."""
_tell: ContextVar[Listener] = ContextVar("tell", default=no_listener)


def listening(tell: Listener) -> AbstractContextManager[None]:
    """A context with `tell` as the receiver of the events of tasks."""
    return assigned(_tell, tell)


def listener() -> Listener:
    """The listener of the running task."""
    return _tell.get()
