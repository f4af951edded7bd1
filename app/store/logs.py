"""Logs of arms. All functions take a session."""

from __future__ import annotations

from sqlalchemy import and_, func, or_, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.access.rules import check_owner
from joulepath.app.exceptions.stored import TooManyLogs, UnknownLog
from joulepath.app.store.paging import having, position_after, position_of
from joulepath.app.store.tables import StoredLog, is_id

_LIGHT = defer(StoredLog.body, raiseload=True)
"""Leaves out the file of a log."""


def add(session: Session, log: StoredLog, most: int) -> None:
    """Adds a log. Raises TooManyLogs if all logs together would exceed `most` bytes."""
    stored = session.scalar(select(func.sum(StoredLog.size))) or 0
    if stored + log.size > most:
        raise TooManyLogs(most)
    session.add(log)


def get(session: Session, log_id: str) -> StoredLog:
    """A log with its file. Raises UnknownLog."""
    return _found(session.get(StoredLog, log_id) if is_id(log_id) else None)


def about(session: Session, log_id: str) -> StoredLog:
    """A log without its file. Raises UnknownLog."""
    return _found(session.get(StoredLog, log_id, options=[_LIGHT]) if is_id(log_id) else None)


def page(
    session: Session, limit: int, after: str | None, search: str | None
) -> tuple[list[StoredLog], str | None]:
    """Up to `limit` logs without their files, newest first, and the `after` of the next page; None
    on the last page. With a `search`, those that have this text in their name or robot.
    """
    query = (
        select(StoredLog)
        .options(_LIGHT)
        .order_by(StoredLog.created.desc(), StoredLog.id.desc())
        .limit(limit + 1)
    )
    if search is not None:
        query = query.where(having(search, StoredLog.name, StoredLog.robot))
    if after is not None:
        created, log_id = position_after(after)
        query = query.where(
            or_(
                StoredLog.created < created,
                and_(StoredLog.created == created, StoredLog.id < log_id),
            )
        )
    found = list(session.scalars(query))
    more, found = len(found) > limit, found[:limit]
    return found, position_of(found[-1]) if more else None


def rename(session: Session, log_id: str, name: str | None, client: Client) -> StoredLog:
    """Gives a log a name, or none. Raises UnknownLog or NotOwner."""
    log = about(session, log_id)
    check_owner(client, log.owner)
    log.name = name
    return log


def delete(session: Session, log_id: str, client: Client) -> None:
    """Deletes a log. Raises UnknownLog or NotOwner."""
    log = about(session, log_id)
    check_owner(client, log.owner)
    session.execute(delete_from(StoredLog).where(StoredLog.id == log.id))


def _found(log: StoredLog | None) -> StoredLog:
    if log is None:
        raise UnknownLog
    return log
