"""Storage of a task's result and of the answers to which it refers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import timedelta
from functools import partial

from sqlalchemy.orm import Session

from joulepath.app.engine.result import StoredAnswer, TaskResult
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.settings import Settings
from joulepath.app.store import answers, cache, known_motions
from joulepath.app.store.cache import Answered, Asked
from joulepath.app.store.store import Store


class _TooLarge(Exception):
    """The answer alone exceeds the space for answers."""


async def store_answers(
    store: Store,
    settings: Settings,
    kind: str,
    result: TaskResult,
    owner: str | None,
    cell: str | None = None,
) -> TaskResult:
    """The result, after storing the answers to which it refers.

    `result.stored` are answers of the endpoint `kind` with an `owner`. Old or excessive answers are
    deleted. The motions of the `cell` are kept. Raises StoreUnavailable.
    """

    def keep(session: Session) -> None:
        if cell is not None:
            known_motions.keep(session, cell, result.motions)

    if result.stored:
        await _put(store, settings, kind, result.stored, owner, also=keep, are_parts=True)
    return replace(result, stored=(), motions={})


async def keep_answer(
    store: Store,
    settings: Settings,
    kind: str,
    result: TaskResult,
    owner: str | None,
    asked: Asked | None = None,
) -> TaskResult:
    """The result, after storing it as `result.kept_as` for requests equal to `asked`.

    Without the database, the result has no id of its own.
    """
    assert result.kept_as is not None
    kept = StoredAnswer(result.kept_as, result.document, result.figures, asked=result.asked)

    def remember(session: Session) -> None:
        if asked is not None:
            cache.remember(session, [Answered(asked, kept.id, result.is_optimal)])

    try:
        await _put(store, settings, kind, [kept], owner, settings.answers_max_bytes, remember)
    except (StoreUnavailable, _TooLarge):
        return result.not_kept()
    return replace(result, kept_as=None)


async def _put(
    store: Store,
    settings: Settings,
    kind: str,
    stored: Sequence[StoredAnswer],
    owner: str | None,
    most: int | None = None,
    also: Callable[[Session], None] | None = None,
    are_parts: bool = False,
) -> None:
    """Stores answers, and prunes if it is time; does something else in the same transaction.

    Raises StoreUnavailable, or _TooLarge above `most` bytes.
    """

    def put(session: Session) -> int:
        size = sum(
            answers.put(session, kind, answer, owner=owner, is_part=are_parts) for answer in stored
        )
        if most is not None and size > most:
            raise _TooLarge
        if also is not None:
            also(session)
        return size

    if not store.pruning.due(await store.write(put), settings.answers_max_bytes):
        return
    target, age = (
        store.pruning.target(settings.answers_max_bytes),
        timedelta(days=settings.answers_max_age),
    )
    try:
        await store.write(partial(answers.prune, max_bytes=target, max_age=age), frees=True)
    except StoreUnavailable:
        store.pruning.failed()  # the answers are stored
