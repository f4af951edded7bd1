"""Answers that another answer refers to: workers write a mark for each, and the service puts its path in the place."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from sqlalchemy.orm import Session

from app.engine.reply import Reply
from app.settings import Settings
from app.store import answers
from app.store.store import Store
from app.tasks.stored_answers import reference


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
        body = body.replace(reference(k).encode(), f"/answers/{answer_id}".encode())
    return replace(reply, body=body, kept=())
