"""Stored answers. All functions take a session: `await store.write(partial(put, …))`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any

import orjson
from sqlalchemy import Select, and_, func, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session, defer

from joulepath.app.access.client import Client
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.result import StoredAnswer
from joulepath.app.exceptions.stored import AnswerInUse, UnknownAnswer
from joulepath.app.store.paging import having, page_of
from joulepath.app.store.tables import Answer, Iteration, Job, JobRequest, by_id, now

_WITHOUT_DOCUMENTS = [
    defer(column, raiseload=True) for column in (Answer.body, Answer.request, Answer.typed)
]


def put(
    session: Session,
    kind: str,
    answer: StoredAnswer,
    study_id: str | None = None,
    owner: str | None = None,
    is_part: bool = False,
) -> int:
    """Stores an answer, the JSON document of the endpoint `kind`, and its request. Returns their
    size as they are kept [byte]. A part is a motion of another answer.

    The answer of a study stays until the study is deleted; any other until `prune` deletes it.
    """
    row = _row(kind, packed_answer(answer), study_id=study_id, owner=owner, is_part=is_part)
    session.add(row)
    return row.size


def packed_answer(answer: StoredAnswer) -> StoredAnswer:
    """The answer with its document and its request compressed."""
    asked = None if answer.asked is None else packed(answer.asked)
    return replace(answer, body=packed(answer.body), asked=asked)


def put_of_job(
    session: Session, kind: str, compressed: StoredAnswer, job: Job, is_part: bool = False
) -> None:
    """Stores a compressed answer until the deletion of its job."""
    session.add(_row(kind, compressed, job_id=job.id, owner=job.owner, is_part=is_part))


def _row(kind: str, compressed: StoredAnswer, **whose: str | bool | None) -> Answer:
    body, asked = compressed.body, compressed.asked
    return Answer(
        id=compressed.id,
        kind=compressed.kind or kind,
        created=now(),
        size=len(body) + len(asked or b""),
        body=body,
        request=asked,
        **vars(compressed.figures),
        **whose,
    )


def get(session: Session, answer_id: str) -> tuple[Answer, bytes]:
    """A stored answer and its JSON document. Raises UnknownAnswer."""
    answer = by_id(session, Answer, answer_id, UnknownAnswer)
    return answer, unpacked(answer.body)


def request_of(session: Session, answer: Answer) -> Any:
    """The request of an answer as it was sent, for orjson; None for a part of another answer."""
    asked = answer.request or session.scalar(
        select(JobRequest.body).where(JobRequest.answer_id == answer.id)
    )
    if asked is not None:
        return orjson.Fragment(unpacked(asked))
    return session.scalar(select(Iteration.request).where(Iteration.answer_id == answer.id))


def of_job(session: Session, job_id: str, kind: str) -> bytes | None:
    """The compressed answer of this kind of a job; None without one."""
    return session.scalar(select(Answer.body).where(Answer.job_id == job_id, Answer.kind == kind))


@dataclass(frozen=True)
class Wanted:
    """Which answers a list has."""

    whole: bool = False
    """Whether to leave out parts, and answers of jobs and studies."""
    job: str | None = None
    """Id of the job of the answers; None: all."""
    search: str | None = None
    """Text in the name, the robot or the kind, in upper or lower case; None: any."""

    def of(self, query: Select[Any]) -> Select[Any]:
        """The query for these answers."""
        if self.whole:
            query = query.where(
                Answer.is_part.is_(False), Answer.job_id.is_(None), Answer.study_id.is_(None)
            )
        if self.job is not None:
            query = query.where(Answer.job_id == self.job)
        return query.where(having(self.search, Answer.name, Answer.robot, Answer.kind))


def page(
    session: Session, limit: int, after: str | None, wanted: Wanted
) -> tuple[list[Answer], str | None]:
    """Up to `limit` answers without their documents, newest first, and the `after` of the next
    page; None on the last page."""
    query = wanted.of(select(Answer)).options(*_WITHOUT_DOCUMENTS)
    return page_of(session, query, Answer, limit, after)


def rename(
    session: Session,
    answer_id: str,
    name: str | None,
    typed: dict[str, str] | None,
    client: Client,
) -> Answer:
    """Gives an answer a name, or none, and the texts of its request's numbers, if there are any.
    Raises UnknownAnswer or NotOwner.
    """
    documents = [defer(column, raiseload=True) for column in (Answer.body, Answer.request)]
    answer = by_id(session, Answer, answer_id, UnknownAnswer, client, options=documents)
    answer.name = name
    if typed is not None:
        answer.size += len(orjson.dumps(typed)) - len(orjson.dumps(answer.typed or {}))
        answer.typed = typed
    return answer


def delete(session: Session, answer_id: str, client: Client) -> None:
    """Deletes an answer. Raises UnknownAnswer, NotOwner, or AnswerInUse for an answer of a study or
    of a job.
    """
    answer = by_id(session, Answer, answer_id, UnknownAnswer, client)
    if answer.study_id is not None or answer.job_id is not None:
        raise AnswerInUse
    session.delete(answer)


def prune(session: Session, max_bytes: int, max_age: timedelta) -> None:
    """Deletes answers without study or job: those older than `max_age`, then the oldest answers of
    the clients with most bytes, until the rest has at most `max_bytes`.

    A client keeps all its answers if they have at most an equal share of `max_bytes`.
    """
    free = and_(Answer.study_id.is_(None), Answer.job_id.is_(None))
    session.execute(delete_from(Answer).where(free, Answer.created < now() - max_age))
    newest_first = func.sum(Answer.size).over(
        partition_by=Answer.owner, order_by=(Answer.created.desc(), Answer.id)
    )
    own = select(Answer.id, Answer.size, newest_first.label("bytes")).where(free).subquery()
    least_first = func.sum(own.c.size).over(order_by=(own.c.bytes, own.c.id))
    so_far = select(own.c.id, least_first.label("bytes")).subquery()
    session.execute(
        delete_from(Answer).where(
            Answer.id.in_(select(so_far.c.id).where(so_far.c.bytes > max_bytes))
        )
    )
