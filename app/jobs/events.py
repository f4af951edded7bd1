"""The events of a job, from the database and as they happen."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from functools import partial

from fastapi.sse import format_sse_event
from sqlalchemy.orm import Session

from joulepath.app.http.event_stream import COMMENT, STREAM
from joulepath.app.jobs.dispatcher import Dispatcher
from joulepath.app.store import job_events
from joulepath.app.store.store import Store


@dataclass(frozen=True)
class EventSettings:
    """Settings of event streams."""

    batch: int = 500
    """Most events of one read."""
    look: float = 1.0
    """Time [s] between two queries for events of other services."""
    gather: float = 0.2
    """Least time [s] between two reads for one reader; events in between are sent together."""


EVENTS = EventSettings()


@dataclass(frozen=True)
class _Batch:
    """Some events as they are sent, the number of the last one, and whether nothing follows."""

    text: bytes
    count: int
    last: int
    over: bool


async def events_after(
    store: Store, dispatcher: Dispatcher, job_id: str, number: int
) -> AsyncIterator[bytes]:
    """Server-sent events after `number`, until the end of the job or of the service.

    Readers at the same position of one job share the reads and the encoded events.
    """
    changes = dispatcher.changes
    bell = changes.listen(job_id)
    quiet = 0.0
    try:
        while True:
            # Events before the stop of the service are still sent.
            is_last = dispatcher.draining
            read = partial(_batch, job_id=job_id, number=number)
            batch = await changes.shared((job_id, number), partial(store.read, read))
            number = batch.last
            if batch.text:
                quiet = 0.0
                yield batch.text
            elif quiet >= STREAM.pause:
                quiet = 0.0
                yield COMMENT
            if batch.over or is_last:
                return
            # An incomplete batch is the last one.
            if batch.count < EVENTS.batch:
                await asyncio.sleep(EVENTS.gather)
                quiet += EVENTS.gather
            if not batch.count:
                await changes.wait(bell, EVENTS.look)
                quiet += EVENTS.look
    finally:
        changes.leave(job_id, bell)


async def ended_by(store: Store, job_id: str, number: int) -> bool:
    """Whether a job has ended and no event follows `number`."""
    batch = await store.read(partial(_batch, job_id=job_id, number=number))
    return batch.over and not batch.count


def _batch(session: Session, job_id: str, number: int) -> _Batch:
    found, over = job_events.after(session, job_id, number, EVENTS.batch)
    texts = [
        format_sse_event(data_str=json.dumps(each.data), event=each.name, id=str(each.number))
        for each in found
    ]
    return _Batch(b"".join(texts), len(found), found[-1].number if found else number, over)
