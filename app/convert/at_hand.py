"""Context variables with the items of the database that accompany a task."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")


@contextmanager
def at_hand(variable: ContextVar[T], value: T) -> Iterator[None]:
    """Within the context, and its thread, the variable has this value."""
    before = variable.set(value)
    try:
        yield
    finally:
        variable.reset(before)
