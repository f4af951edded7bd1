"""Positions in paged lists, newest first, and what a search finds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar, TypeVarTuple

from sqlalchemy import ColumnElement, Select, and_, or_, true
from sqlalchemy.orm import InstrumentedAttribute, Session

from joulepath.app.store.tables import Answer, Job, StoredLog, Study

R = TypeVar("R", Answer, Job, StoredLog, Study)
Listed = Answer | Job | StoredLog | Study
Ts = TypeVarTuple("Ts")

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


def newest_first(
    query: Select[*Ts],
    table: type[Listed],
    limit: int,
    after: str | None,
) -> Select[*Ts]:
    """One row more than a page of `limit` rows, from the position `after` on; None: from the newest
    row on.
    """
    if after is not None:
        microseconds, row_id = after.split("_")
        created = _EPOCH + int(microseconds) * _MICROSECOND
        older = and_(table.created == created, table.id < row_id)
        query = query.where(or_(table.created < created, older))
    return query.order_by(table.created.desc(), table.id.desc()).limit(limit + 1)


def page_of(
    session: Session, query: Select[R], table: type[R], limit: int, after: str | None
) -> tuple[list[R], str | None]:
    """Up to `limit` rows of a query, newest first, and the `after` of the next page; None on the
    last page.
    """
    rows = session.scalars(newest_first(query, table, limit, after)).all()
    return list(rows[:limit]), following(rows, limit)


def following(rows: Sequence[Listed], limit: int) -> str | None:
    """The `after` of the next page, by the rows of `newest_first`; None on the last page."""
    if len(rows) <= limit:
        return None
    last = rows[limit - 1]
    return f"{(last.created - _EPOCH) // _MICROSECOND}_{last.id}"


def having(text: str | None, *places: InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    """Whether a text is in one of the columns, in upper or lower case; None is everywhere."""
    if text is None:
        return true()
    return or_(*(each.icontains(text, autoescape=True) for each in places))
