"""Whole answers, kept by reference. Each function works on a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

import zlib
from datetime import timedelta

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.exceptions import UnknownAnswer
from app.store.tables import Answer, is_id, new_id, now


def put(session: Session, kind: str, body: bytes, study_id: str | None = None) -> str:
    """Keeps an answer, the JSON that the endpoint called `kind` gave, and returns its id.

    That of a study is kept as long as the study is; any other until `prune` drops it.
    """
    compressed = zlib.compress(body)
    answer_id = new_id()
    session.add(
        Answer(id=answer_id, kind=kind, created=now(), study_id=study_id, size=len(compressed), body=compressed)
    )
    return answer_id


def get(session: Session, answer_id: str) -> tuple[Answer, bytes]:
    """A kept answer, and its JSON. Raises UnknownAnswer."""
    answer = session.get(Answer, answer_id) if is_id(answer_id) else None
    if answer is None:
        raise UnknownAnswer
    return answer, zlib.decompress(answer.body)


def prune(session: Session, max_bytes: int, max_age: timedelta) -> None:
    """Drops the answers of no study that are older than `max_age`, then the oldest until the rest fit `max_bytes`."""
    session.flush()
    free = Answer.study_id.is_(None)
    session.execute(delete(Answer).where(free, Answer.created < now() - max_age))
    newest_first = func.sum(Answer.size).over(order_by=(Answer.created.desc(), Answer.id))
    so_far = select(Answer.id, newest_first.label("bytes")).where(free).subquery()
    session.execute(delete(Answer).where(Answer.id.in_(select(so_far.c.id).where(so_far.c.bytes > max_bytes))))
