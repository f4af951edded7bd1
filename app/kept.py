"""Answers that another answer refers to: workers write a mark for each, and the service puts its path in the place."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import Any

from sqlalchemy.orm import Session

from app.errors import InvalidRequest, Reply
from app.settings import Settings
from app.store import answers
from app.store.store import Store
from app.tasks import json_reply

MOST_BYTES = 1 << 27
"""Of all answers that one refers to, before they are compressed."""


class Shelf:
    """Collects whole answers for a reply that refers to them."""

    def __init__(self) -> None:
        self._bodies: list[bytes] = []

    def add(self, content: dict[str, Any]) -> str:
        """Takes an answer, and gives the mark that stands for its path. Raises InvalidRequest."""
        self._bodies.append(json_reply(content).body)
        if sum(map(len, self._bodies)) > MOST_BYTES:
            message = "The answers are too large together: lengthen `sample_period`, or ask for fewer"
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return _reference(len(self._bodies) - 1)

    def kept(self) -> tuple[bytes, ...]:
        """What was taken, for `Reply.kept`."""
        return tuple(self._bodies)


def _reference(k: int) -> str:
    """The mark of the k-th of `Reply.kept`, with a character that no name of a caller's may hold."""
    return f"\x7fkept/{k}\x7f"


async def keep(store: Store, settings: Settings, kind: str, reply: Reply) -> Reply:
    """Puts the reply's `kept`, answers of the endpoint `kind`, into the store, and their paths into its body.

    Raises StoreUnavailable.
    """
    if not reply.kept:
        return reply

    def put(session: Session) -> list[str]:
        ids = [answers.put(session, kind, body) for body in reply.kept]
        answers.prune(session, settings.answers_max_bytes, timedelta(days=settings.answers_max_age))
        return ids

    body = reply.body
    for k, answer_id in enumerate(await store.write(put)):
        body = body.replace(_reference(k).encode(), f"/answers/{answer_id}".encode())
    return replace(reply, body=body, kept=())
