"""Shares of API keys in the database, and the stored form of idempotency keys."""

from __future__ import annotations

import hashlib

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session


def room_of(
    session: Session,
    owner: str | None,
    most: int,
    whose: InstrumentedAttribute[str | None],
    amount: ColumnElement[int],
    *which: ColumnElement[bool],
) -> tuple[int, int]:
    """How much a client may add, and how much all clients together may add.

    A client may hold half of what the others leave, rounded up. As long as two rows or bytes are
    left, one client cannot take both. Without API keys, there is one client without a share.

    Args:
        session: session of the database.
        owner: name of the client; None without API keys.
        most: largest total of all clients.
        whose: column with the owners of the rows.
        amount: aggregate of the rows that is limited, such as `COUNT`.
        which: conditions of the counted rows.
    """
    rows = session.execute(select(whose, amount).where(*which).group_by(whose))
    held: dict[str | None, int] = dict(rows.all())
    own, all_held = held.get(owner, 0), sum(held.values())
    share = most - all_held + own
    return (share if owner is None else (share + 1) // 2) - own, most - all_held


COUNT = func.count()
"""The number of rows."""


def stored_key(key: str, owner: str | None) -> str:
    """The stored form of an `Idempotency-Key`: equal keys of two clients differ."""
    return key if owner is None else hashlib.sha256(f"{owner} {key}".encode()).hexdigest()
