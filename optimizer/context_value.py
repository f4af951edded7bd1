"""Values of context variables within a block of code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

T = TypeVar("T")


@contextmanager
def assigned(variable: ContextVar[T], value: T) -> Iterator[None]:
    """Context that assigns a value to a variable, in the current thread only."""
    before = variable.set(value)
    try:
        yield
    finally:
        variable.reset(before)
