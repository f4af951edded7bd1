"""Stores the answers that a task's result refers to."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from sqlalchemy.orm import Session

from app.engine.result import TaskResult
from app.settings import Settings
from app.store import answers
from app.store.store import Store


async def store_answers(
    store: Store, settings: Settings, kind: str, result: TaskResult, owner: str | None
) -> TaskResult:
    """The result, once the answers that it refers to are stored.

    Stores `result.stored`, answers of the endpoint `kind` that belong to `owner`. Deletes answers that are too old or
    too many. Raises StoreUnavailable.
    """
    if not result.stored:
        return result

    def put(session: Session) -> None:
        for answer in result.stored:
            answers.put(session, kind, answer.body, answer_id=answer.id, owner=owner)
        answers.prune(session, settings.answers_max_bytes, timedelta(days=settings.answers_max_age))

    await store.write(put)
    return replace(result, stored=())
