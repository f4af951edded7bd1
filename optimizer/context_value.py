"""Values of context variables within a block of code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")


@contextmanager
def assigned(variable: ContextVar[T], value: T) -> Iterator[None]:
    """Context with a value assigned to a variable; other threads keep their own values."""
    before = variable.set(value)
    try:
        yield
    finally:
        variable.reset(before)
