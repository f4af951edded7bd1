"""Stored answers. All functions take a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from sqlalchemy import and_, func, or_, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.access.rules import check_owner
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import AnswerInUse, UnknownAnswer
from joulepath.app.store.paging import position_after, position_of
from joulepath.app.store.tables import Answer, Job, is_id, now


def put(
    session: Session,
    kind: str,
    answer: StoredAnswer,
    study_id: str | None = None,
    owner: str | None = None,
) -> int:
    """Stores an answer, the JSON document of the endpoint `kind`. Returns its size as it is kept
    [byte].

    The answer of a study stays until the study is deleted; any other until `prune` deletes it.
    """
    body = packed(answer.body)
    session.add(_row(kind, replace(answer, body=body), study_id=study_id, owner=owner))
    return len(body)


def put_of_job(session: Session, kind: str, compressed: StoredAnswer, job: Job) -> None:
    """Stores a compressed answer until the deletion of its job."""
    session.add(_row(kind, compressed, job_id=job.id, owner=job.owner))


def _row(kind: str, compressed: StoredAnswer, **whose: str | None) -> Answer:
    id, body, figures = compressed.id, compressed.body, compressed.figures
    return Answer(
        id=id, kind=kind, created=now(), size=len(body), body=body, **vars(figures), **whose
    )


def get(session: Session, answer_id: str) -> tuple[Answer, bytes]:
    """A stored answer and its JSON document. Raises UnknownAnswer."""
    answer = session.get(Answer, answer_id) if is_id(answer_id) else None
    if answer is None:
        raise UnknownAnswer
    return answer, unpacked(answer.body)


def of_job(session: Session, job_id: str, kind: str) -> bytes | None:
    """The compressed answer of this kind of a job; None without one."""
    return session.scalar(select(Answer.body).where(Answer.job_id == job_id, Answer.kind == kind))


def page(session: Session, limit: int, after: str | None) -> tuple[list[Answer], str | None]:
    """Up to `limit` answers without their documents, newest first, and the `after` of the next
    page; None on the last page."""
    query = select(Answer).order_by(Answer.created.desc(), Answer.id.desc()).limit(limit + 1)
    if after is not None:
        created, answer_id = position_after(after)
        query = query.where(
            or_(Answer.created < created, and_(Answer.created == created, Answer.id < answer_id))
        )
    found = list(session.scalars(query.options(defer(Answer.body, raiseload=True))))
    more, found = len(found) > limit, found[:limit]
    return found, position_of(found[-1]) if more else None


def delete(session: Session, answer_id: str, client: Client) -> None:
    """Deletes an answer. Raises UnknownAnswer, NotOwner, or AnswerInUse for an answer of a study or
    of a job.
    """
    answer = session.get(Answer, answer_id) if is_id(answer_id) else None
    if answer is None:
        raise UnknownAnswer
    check_owner(client, answer.owner)
    if answer.study_id is not None or answer.job_id is not None:
        raise AnswerInUse
    session.delete(answer)


def prune(session: Session, max_bytes: int, max_age: timedelta) -> None:
    """Deletes answers without study or job: older than `max_age`, then the oldest above
    `max_bytes`.
    """
    free = and_(Answer.study_id.is_(None), Answer.job_id.is_(None))
    session.execute(delete_from(Answer).where(free, Answer.created < now() - max_age))
    newest_first = func.sum(Answer.size).over(order_by=(Answer.created.desc(), Answer.id))
    so_far = select(Answer.id, newest_first.label("bytes")).where(free).subquery()
    session.execute(
        delete_from(Answer).where(
            Answer.id.in_(select(so_far.c.id).where(so_far.c.bytes > max_bytes))
        )
    )
