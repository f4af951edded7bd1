"""Answers by their requests, in SQLite and PostgreSQL: replacement, and two at the same time."""

from __future__ import annotations

import asyncio
import threading
from functools import partial

from sqlalchemy.orm import Session

from joulepath.app.engine.result import StoredAnswer
from joulepath.app.store import answers, cache
from joulepath.app.store.cache import Answered, Asked
from joulepath.app.store.store import Store
from joulepath.app.store.tables import new_id
from tests.app.databases import on_both_databases

ASKED = Asked("a" * 64, 10.0)
OTHER = Asked("b" * 64, 10.0)


def keep(session: Session, *asked: Asked, is_optimal: bool = True) -> str:
    """Stores an answer to these requests and returns its id."""
    answer = StoredAnswer(new_id(), b"{}")
    answers.put(session, "optimize", answer)
    cache.remember(session, [Answered(each, answer.id, is_optimal) for each in asked])
    return answer.id


async def known(store: Store, *asked: Asked) -> dict[str, str]:
    """Ids of the answers, by the first letter of the key."""
    found = await store.read(partial(cache.find, asked=asked))
    return {each.key[0]: answer.id for each, answer in found.items()}


async def test_what_takes_the_place_of_what(store: Store) -> None:
    assert await known(store, ASKED, OTHER) == {}
    first = await store.write(lambda session: keep(session, OTHER, ASKED, is_optimal=False))
    assert await known(store, ASKED, OTHER) == {"a": first, "b": first}
    assert await known(store, Asked(ASKED.key, 11.0)) == {}
    second = await store.write(lambda session: keep(session, ASKED))
    assert await known(store, Asked(ASKED.key, 11.0), OTHER) == {"a": second, "b": first}
    await store.write(lambda session: keep(session, ASKED, is_optimal=False))
    assert await known(store, ASKED) == {"a": second}, "an optimal one stays"


@on_both_databases
async def test_two_that_remember_the_same_at_the_same_time(store: Store) -> None:
    has_written, may_end = threading.Event(), threading.Event()

    def slow(session: Session) -> str:
        kept = keep(session, ASKED)
        session.flush()
        has_written.set()
        assert may_end.wait(60)
        return kept

    first = asyncio.create_task(store.write(slow))
    await asyncio.to_thread(has_written.wait, 60)
    second = asyncio.create_task(store.write(lambda session: keep(session, ASKED, OTHER)))
    await asyncio.sleep(0.2)
    may_end.set()
    ids = await first, await second
    # in PostgreSQL, the first; in SQLite, with one writer at a time, the last
    assert (await known(store, ASKED, OTHER)) in [{"a": each, "b": ids[1]} for each in ids]
