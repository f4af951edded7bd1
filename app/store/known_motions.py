"""Motions of moves of cycles, by what was asked: cycles of the same arm in the same cell have moves
in common. Each function works on a session."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import delete, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from joulepath.app.store.tables import KnownMotion, now

MOST_OF_A_CELL = 400
"""Motions that a cycle is given: those of its cell that were used last, some 1 kB each."""
MOST = 20_000
"""Motions that are kept in all."""


def find(session: Session, cell: str) -> dict[str, bytes]:
    """The motions of a cell that were used last, by their keys."""
    query = select(KnownMotion.key, KnownMotion.body).where(KnownMotion.cell == cell)
    found = session.execute(
        query.order_by(KnownMotion.used.desc(), KnownMotion.key).limit(MOST_OF_A_CELL)
    )
    return {row.key: row.body for row in found}


def keep(session: Session, cell: str, motions: Mapping[str, bytes], most: int = MOST) -> None:
    """Keeps motions of a cell that were found or used now; those that were not used for longest go,
    above `most`.

    It never waits for motions that somebody else is keeping, and fails for none.
    """
    if not motions:
        return
    used, left = now(), dict(motions)
    of_cell = KnownMotion.cell == cell, KnownMotion.key.in_(left)
    for known in session.scalars(
        select(KnownMotion).where(*of_cell).with_for_update(skip_locked=True)
    ):
        known.used = used
        del left[known.key]
    if left:
        is_postgresql = session.get_bind().dialect.name == "postgresql"
        insert = postgresql.insert(KnownMotion) if is_postgresql else sqlite.insert(KnownMotion)
        rows = [
            {"cell": cell, "key": key, "used": used, "body": body}
            for key, body in sorted(left.items())
        ]
        session.execute(insert.on_conflict_do_nothing(), rows)
    oldest = session.scalar(
        select(KnownMotion.used).order_by(KnownMotion.used.desc()).offset(most).limit(1)
    )
    if oldest is not None:
        session.execute(delete(KnownMotion).where(KnownMotion.used <= oldest))
