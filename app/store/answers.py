"""Stored answers. Each function works on a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

import zlib
from datetime import timedelta

from sqlalchemy import and_, func, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session

from app.access.client import Client
from app.access.rules import check_owner
from app.exceptions import AnswerInUse, UnknownAnswer
from app.store.tables import Answer, is_id, new_id, now


def put(
    session: Session,
    kind: str,
    body: bytes,
    study_id: str | None = None,
    answer_id: str | None = None,
    owner: str | None = None,
) -> str:
    """Stores an answer, the JSON document of the endpoint `kind`, and returns its id: `answer_id`, or a new one.

    The answer of a study stays until the study is deleted; any other until `prune` deletes it.
    """
    # the fastest level: a front can have a hundred megabytes, and its client waits
    compressed = zlib.compress(body, zlib.Z_BEST_SPEED)
    answer_id = new_id() if answer_id is None else answer_id
    session.add(_answer(answer_id, kind, compressed, study_id=study_id, owner=owner))
    return answer_id


def put_of_job(session: Session, kind: str, compressed: bytes, job_id: str, answer_id: str, owner: str | None) -> None:
    """Stores an answer that is compressed already. It stays until its job is deleted."""
    session.add(_answer(answer_id, kind, compressed, job_id=job_id, owner=owner))


def _answer(answer_id: str, kind: str, compressed: bytes, **whose: str | None) -> Answer:
    return Answer(id=answer_id, kind=kind, created=now(), size=len(compressed), body=compressed, **whose)


def get(session: Session, answer_id: str) -> tuple[Answer, bytes]:
    """A stored answer and its JSON document. Raises UnknownAnswer."""
    answer = session.get(Answer, answer_id) if is_id(answer_id) else None
    if answer is None:
        raise UnknownAnswer
    return answer, zlib.decompress(answer.body)


def delete(session: Session, answer_id: str, client: Client) -> None:
    """Deletes an answer. Raises UnknownAnswer, NotOwner, or AnswerInUse for an answer of a study or of a job."""
    answer = session.get(Answer, answer_id) if is_id(answer_id) else None
    if answer is None:
        raise UnknownAnswer
    check_owner(client, answer.owner)
    if answer.study_id is not None or answer.job_id is not None:
        raise AnswerInUse
    session.delete(answer)


def prune(session: Session, max_bytes: int, max_age: timedelta) -> None:
    """Deletes answers of no study and no job: those older than `max_age`, then the oldest until the rest fit
    `max_bytes`."""
    free = and_(Answer.study_id.is_(None), Answer.job_id.is_(None))
    session.execute(delete_from(Answer).where(free, Answer.created < now() - max_age))
    newest_first = func.sum(Answer.size).over(order_by=(Answer.created.desc(), Answer.id))
    so_far = select(Answer.id, newest_first.label("bytes")).where(free).subquery()
    session.execute(delete_from(Answer).where(Answer.id.in_(select(so_far.c.id).where(so_far.c.bytes > max_bytes))))
