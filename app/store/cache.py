"""Stored answers by the requests that they answer. Each function works on a session."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.store.answers import get
from app.store.tables import CachedAnswer


@dataclass(frozen=True)
class Asked:
    """A request as the cache knows it: what tells it from others, and its deadline [s]."""

    key: str
    deadline: float


def find(session: Session, asked: Asked) -> tuple[datetime, bytes] | None:
    """When an answer to this request was stored, and its document; None if there is none.

    An answer that is not optimal does for requests with the same deadline or a shorter one.
    """
    known = session.scalar(select(CachedAnswer).where(CachedAnswer.key == asked.key))
    if known is None or (known.deadline is not None and known.deadline < asked.deadline):
        return None
    answer, document = get(session, known.answer_id)
    return answer.created, document


def remember(session: Session, asked: Asked, answer_id: str, is_optimal: bool) -> None:
    """Has a stored answer answer this request from now on. Nothing takes the place of an optimal one but another."""
    known = session.get(CachedAnswer, asked.key)
    if known is None:
        known = CachedAnswer(key=asked.key)
        session.add(known)
    elif known.deadline is None and not is_optimal:
        return
    known.answer_id, known.deadline = answer_id, None if is_optimal else asked.deadline
