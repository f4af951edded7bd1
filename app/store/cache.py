"""Stored answers by the requests that they answer. Each function works on a session."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NotRequired, TypedDict

from sqlalchemy import select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from joulepath.app.store.tables import Answer, CachedAnswer


class Meaning(TypedDict):
    """What a request means to a version of the service: the hash of its canonical form, and the
    name of its robot.

    Of a cycle also its cell, see `KnownMotion`.
    """

    version: str
    digest: str
    robot: str
    cell: NotRequired[str]


@dataclass(frozen=True)
class Asked:
    """A request as the cache knows it: what tells it from others, and its deadline [s]."""

    key: str
    deadline: float


@dataclass(frozen=True)
class Answered:
    """A request, the id of the answer to it, and whether no more time would make that better."""

    asked: Asked
    answer_id: str
    is_optimal: bool


def find(session: Session, asked: Sequence[Asked]) -> dict[Asked, Answer]:
    """The stored answers to some of these requests.

    An answer that is not optimal does for requests with the same deadline or a shorter one.
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
    """Has stored answers answer these requests from now on. Nothing takes the place of an optimal
    one but another.

    It never waits for a request that somebody else is remembering, and fails for none.
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
        is_postgresql = session.get_bind().dialect.name == "postgresql"
        insert = postgresql.insert(CachedAnswer) if is_postgresql else sqlite.insert(CachedAnswer)
        values = [
            {"key": key, "answer_id": own.answer_id, "deadline": _longest(own)}
            for key, own in sorted(new.items())
        ]
        session.execute(insert.on_conflict_do_nothing(), values)


def _longest(own: Answered) -> float | None:
    """Longest deadline [s] of a request that it answers; None if that does not matter."""
    return None if own.is_optimal else own.asked.deadline
