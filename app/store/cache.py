"""Stored answers by their requests. All functions take a session."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NotRequired, TypedDict

from sqlalchemy import select
from sqlalchemy.orm import Session

from joulepath.app.store.tables import Answer, CachedAnswer, insert_new


class Meaning(TypedDict):
    """The meaning of a request in a version of the service: hash of its canonical form, robot.

    A cycle also has the key of its cell, see `KnownMotion`.
    """

    version: str
    digest: str
    robot: str
    cell: NotRequired[str]


@dataclass(frozen=True)
class Asked:
    """Key of a request in the cache, and its deadline [s]."""

    key: str
    deadline: float


@dataclass(frozen=True)
class Answered:
    """A request, the id of its answer, and whether more time could not improve the answer."""

    asked: Asked
    answer_id: str
    is_optimal: bool


def find(session: Session, asked: Sequence[Asked]) -> dict[Asked, Answer]:
    """Stored answers to these requests, as far as there are any.

    A suboptimal answer suffices for requests with the same or a shorter deadline.
    """
    query = select(CachedAnswer, Answer).join(Answer, Answer.id == CachedAnswer.answer_id)
    query = query.where(CachedAnswer.key.in_({each.key for each in asked}))
    known = {cached.key: (cached.deadline, answer) for cached, answer in session.execute(query)}
    found = {}
    for each in asked:
        deadline, answer = known.get(each.key, (0.0, None))
        if answer is not None and (deadline is None or deadline >= each.deadline):
            found[each] = answer
    return found


def remember(session: Session, answered: Iterable[Answered]) -> None:
    """Links requests to stored answers. Only an optimal answer may replace an optimal one.

    Requests locked by another writer are skipped without waiting.
    """
    new = {each.asked.key: each for each in answered}
    if not new:
        return
    session.flush()  # the answers come first
    rows = select(CachedAnswer).where(CachedAnswer.key.in_(new)).with_for_update(skip_locked=True)
    for known in session.scalars(rows):
        own = new.pop(known.key)
        if known.deadline is not None or own.is_optimal:
            known.answer_id, known.deadline = own.answer_id, _longest(own)
    if new:
        values = [
            {"key": key, "answer_id": own.answer_id, "deadline": _longest(own)}
            for key, own in sorted(new.items())
        ]
        insert_new(session, CachedAnswer, values)


def _longest(own: Answered) -> float | None:
    """Longest deadline [s] of a request with this answer; None for any deadline."""
    return None if own.is_optimal else own.asked.deadline
