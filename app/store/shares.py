"""Shares of clients in what the database may hold, and their idempotency keys."""

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
    """What a client may still add, and what all clients together may add.

    A client may hold at most half of what the others leave, so that there is always room for
    another client. Without API keys, there is one client, and everything is its share.

    Args:
        session: session of the database.
        owner: the client; None without API keys.
        most: largest total of all clients.
        whose: column with the owners of the rows.
        amount: aggregate that is limited, such as their number.
        which: conditions of the rows that count.
    """
    rows = session.execute(select(whose, amount).where(*which).group_by(whose))
    held: dict[str | None, int] = dict(rows.all())
    own, all_held = held.get(owner, 0), sum(held.values())
    share = most - all_held + own
    return (share if owner is None else (share + 1) // 2) - own, most - all_held


COUNT = func.count()
"""The number of rows."""


def stored_key(key: str, owner: str | None) -> str:
    """The form in which the database keeps an `Idempotency-Key`: clients choose their keys without
    knowledge of each other's."""
    return key if owner is None else hashlib.sha256(f"{owner} {key}".encode()).hexdigest()
