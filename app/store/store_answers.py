"""Stores the answers that a task's result refers to."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from sqlalchemy.orm import Session

from app.engine.result import TaskResult, placeholder
from app.settings import Settings
from app.store import answers
from app.store.store import Store


async def store_answers(store: Store, settings: Settings, kind: str, result: TaskResult) -> TaskResult:
    """The result with the path of each stored answer in place of its placeholder.

    Stores `result.stored`, answers of the endpoint `kind`, and deletes answers that are too old or too many. Raises
    StoreUnavailable.
    """
    if not result.stored:
        return result

    def put(session: Session) -> list[str]:
        ids = [answers.put(session, kind, body) for body in result.stored]
        answers.prune(session, settings.answers_max_bytes, timedelta(days=settings.answers_max_age))
        return ids

    document = result.document
    for k, answer_id in enumerate(await store.write(put)):
        document = document.replace(placeholder(k).encode(), f"/answers/{answer_id}".encode())
    return replace(result, document=document, stored=())
