"""Many readers of one job's events share reads of the store, and all get every event."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any, TypeVar

import pytest
from sqlalchemy.orm import Session

from joulepath.app.jobs import events
from joulepath.app.jobs.changes import Changes
from joulepath.app.jobs.events import events_after
from joulepath.app.store.store import Store
from tests.app.jobs.test_dispatcher import Service, is_done, sent, until

T = TypeVar("T")
READERS = 300
# one read for every change of the job, and for the ends of late readers
MOST_READS = 40


class CountedStore:
    """A store with a count of its reads."""

    def __init__(self, store: Store) -> None:
        self.store, self.reads = store, 0

    async def read(self, work: Callable[[Session], T]) -> T:
        self.reads += 1
        return await self.store.read(work)


async def text(found: AsyncIterator[bytes]) -> bytes:
    return b"".join([each async for each in found])


async def test_readers_at_the_same_place_share_one_read(store: Store) -> None:
    service, counted = Service("only", store), CountedStore(store)
    job_id = await sent(service, count=5)
    following: Any = counted
    readers = [
        asyncio.create_task(text(events_after(following, service.dispatcher, job_id, 0)))
        for _ in range(READERS)
    ]
    service.work.free.set()
    service.dispatcher.start()
    await until(lambda: is_done(service, job_id))
    first, *others = await asyncio.gather(*readers)
    assert (
        first.count(b"event: request\n") == 5
        and first.endswith(b"\n\n")
        and b"event: end\n" in first
    )
    numbers = [
        int(line.removeprefix(b"id: ")) for line in first.splitlines() if line.startswith(b"id: ")
    ]
    assert numbers == list(range(1, len(numbers) + 1))
    assert all(other == first for other in others)
    assert counted.reads <= MOST_READS
    late = await text(events_after(following, service.dispatcher, job_id, numbers[-2]))
    assert late.startswith(b"event: end\n")
    await service.dispatcher.stop()


async def test_a_quiet_stream_has_comments(
    monkeypatch: pytest.MonkeyPatch, store: Store, service: Service
) -> None:
    monkeypatch.setattr(events, "STREAM", replace(events.STREAM, pause=0.0))
    monkeypatch.setattr(events, "EVENTS", replace(events.EVENTS, look=0.0))
    monkeypatch.setattr(events, "EVENTS", replace(events.EVENTS, gather=0.0))
    found = events_after(store, service.dispatcher, await sent(service), 0)
    assert [await anext(found), await anext(found)] == [
        b'event: state\ndata: {"state": "waiting"}\nid: 1\n\n',
        b": working\n\n",
    ]
    await found.aclose()  # type: ignore[attr-defined]


async def test_what_happens_during_a_read_begins_another() -> None:
    """A read begun before an event lacks the event, so a later caller needs another read."""
    changes, begun, free = Changes(), list[int](), asyncio.Event()

    async def read() -> int:
        begun.append(len(begun))
        number = begun[-1]
        await free.wait()
        return number

    first, second = (asyncio.create_task(changes.shared("x", read)) for _ in range(2))
    await asyncio.sleep(0)
    changes.ring(["job"])
    third = asyncio.create_task(changes.shared("x", read))
    await asyncio.sleep(0)
    first.cancel()
    free.set()
    assert await second == 0 and await third == 1
    assert first.cancelled()
    assert await changes.shared("x", read) == 2, "nothing is kept"


async def test_a_read_that_fails_fails_for_all() -> None:
    changes = Changes()

    async def read() -> int:
        await asyncio.sleep(0)
        raise ZeroDivisionError

    left, *asked = (asyncio.create_task(changes.shared(what, read)) for what in "yxx")
    await asyncio.sleep(0)
    left.cancel()
    assert [type(each) for each in await asyncio.gather(*asked, return_exceptions=True)] == [
        ZeroDivisionError
    ] * 2
    gc.collect()  # an error that nobody has retrieved fails this test
