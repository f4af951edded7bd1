"""Requests refused by the library."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from joulepath.optimizer.exceptions import InvalidProblem


@contextmanager
def refusal_of(field: str, match: str | None = None) -> Iterator[None]:
    """An InvalidProblem with the name of a field and some words."""
    with pytest.raises(InvalidProblem, match=match) as refusal:
        yield
    assert refusal.value.field == field
