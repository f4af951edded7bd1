"""Motions of cycles by their requests: cycles of one arm in one cell may share moves.

All functions take a session.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from joulepath.app.store.tables import KnownMotion, insert_new, now


@dataclass(frozen=True)
class KnownMotionSettings:
    """Ceilings of known motions."""

    of_a_cell: int = 400
    """Most motions given to a cycle: the latest of its cell, some 1 kB each."""
    total: int = 20_000
    """Most motions in the database."""


KNOWN_MOTIONS = KnownMotionSettings()


def find(session: Session, cell: str) -> dict[str, bytes]:
    """The latest motions of a cell by their keys."""
    query = select(KnownMotion.key, KnownMotion.body).where(KnownMotion.cell == cell)
    found = session.execute(
        query.order_by(KnownMotion.used.desc(), KnownMotion.key).limit(KNOWN_MOTIONS.of_a_cell)
    )
    return {row.key: row.body for row in found}


def keep(
    session: Session, cell: str, motions: Mapping[str, bytes], most: int = KNOWN_MOTIONS.total
) -> None:
    """Keeps found or used motions of a cell; the least recently used are dropped above `most`.

    Motions locked by another writer are skipped without waiting.
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
        rows = [
            {"cell": cell, "key": key, "used": used, "body": body}
            for key, body in sorted(left.items())
        ]
        insert_new(session, KnownMotion, rows)
    oldest = session.scalar(
        select(KnownMotion.used).order_by(KnownMotion.used.desc()).offset(most).limit(1)
    )
    if oldest is not None:
        session.execute(delete(KnownMotion).where(KnownMotion.used <= oldest))
