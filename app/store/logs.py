"""Logs of arms. All functions take a session."""

from __future__ import annotations

from functools import partial

from sqlalchemy import delete as delete_from
from sqlalchemy import func, select
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.exceptions.stored import TooManyLogs, UnknownLog
from joulepath.app.store.paging import having, page_of
from joulepath.app.store.shares import room_of
from joulepath.app.store.tables import StoredLog, by_id

_LIGHT = defer(StoredLog.body, raiseload=True)
"""Leaves out the file of a log."""


def add(session: Session, log: StoredLog, most: int) -> None:
    """Adds a log. Raises TooManyLogs if all logs would exceed `most` bytes, or if the owner's logs
    would exceed the owner's share of `most`."""
    if log.size > room_of(session, log.owner, most, StoredLog.owner, func.sum(StoredLog.size))[0]:
        raise TooManyLogs(most)
    session.add(log)


def get(session: Session, log_id: str) -> StoredLog:
    """A log with its file. Raises UnknownLog."""
    return by_id(session, StoredLog, log_id, partial(UnknownLog, log_id))


def about(session: Session, log_id: str, client: Client | None = None) -> StoredLog:
    """A log without its file, for a `client` to change it. Raises UnknownLog or NotOwner."""
    unknown = partial(UnknownLog, log_id)
    return by_id(session, StoredLog, log_id, unknown, client, options=[_LIGHT])


def page(
    session: Session, limit: int, after: str | None, search: str | None
) -> tuple[list[StoredLog], str | None]:
    """Up to `limit` logs without their files, newest first, and the `after` of the next page; None
    on the last page. With a `search`, those that have this text in their name or robot.
    """
    found = having(search, StoredLog.name, StoredLog.robot)
    query = select(StoredLog).where(found).options(_LIGHT)
    return page_of(session, query, StoredLog, limit, after)


def rename(session: Session, log_id: str, name: str | None, client: Client) -> StoredLog:
    """Gives a log a name, or none. Raises UnknownLog or NotOwner."""
    log = about(session, log_id, client)
    log.name = name
    return log


def delete(session: Session, log_id: str, client: Client) -> None:
    """Deletes a log. Raises UnknownLog or NotOwner."""
    log = about(session, log_id, client)
    session.execute(delete_from(StoredLog).where(StoredLog.id == log.id))
