"""Positions in paged lists, newest first, and what a search finds."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any, Protocol

from sqlalchemy import ColumnElement, or_
from sqlalchemy.orm import InstrumentedAttribute

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


class Listed(Protocol):
    """A row of a list."""

    created: datetime
    id: str


def position_of(row: Listed) -> str:
    """The `after` of the page following this row."""
    return f"{(row.created - _EPOCH) // _MICROSECOND}_{row.id}"


def position_after(text: str) -> tuple[datetime, str]:
    """Time and id of the row of a position."""
    microseconds, row_id = text.split("_")
    return _EPOCH + int(microseconds) * _MICROSECOND, row_id


def having(text: str, *places: InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    """Whether a text is in one of the columns, in upper or lower case."""
    return or_(*(each.icontains(text, autoescape=True) for each in places))
