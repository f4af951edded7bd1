"""Requests that the library refuses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from joulepath.optimizer.exceptions import InvalidProblem


@contextmanager
def refusal_of(field: str, match: str | None = None) -> Iterator[None]:
    """An InvalidProblem that names a field, and has some words."""
    with pytest.raises(InvalidProblem, match=match) as refusal:
        yield
    assert refusal.value.field == field
