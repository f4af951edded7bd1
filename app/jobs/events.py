"""The events of a job, from the database and as they happen."""

from __future__ import annotations

from collections.abc import AsyncIterator
from functools import partial

from fastapi.sse import ServerSentEvent

from app.jobs.dispatcher import Dispatcher
from app.store import job_events
from app.store.store import Store

_BATCH = 500
LOOK = 1.0
"""Time [s] after which events of other services are looked for."""


async def events_after(
    store: Store, dispatcher: Dispatcher, job_id: str, number: int
) -> AsyncIterator[ServerSentEvent]:
    """The events after that of `number`, until the end of the job or of the service."""
    bell = dispatcher.changes.listen(job_id)
    try:
        while not dispatcher.draining:
            found, over = await store.read(partial(job_events.after, job_id=job_id, number=number, limit=_BATCH))
            for event in found:
                number = event.number
                yield ServerSentEvent(data=event.data, event=event.name, id=str(number))
            if over:
                return
            if not found:
                await dispatcher.changes.wait(bell, LOOK)
    finally:
        dispatcher.changes.leave(job_id, bell)
