"""Wake-up of coroutines waiting for changes of a job in this process."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable, Coroutine, Hashable, Iterable
from typing import Any, TypeVar

T = TypeVar("T")


class Changes:
    """Events of the jobs with waiting coroutines."""

    def __init__(self) -> None:
        self._waiting: defaultdict[str, set[asyncio.Event]] = defaultdict(set)
        self._rung = 0
        self._reads: dict[Hashable, asyncio.Task[Any]] = {}

    def ring(self, job_ids: Iterable[str]) -> None:
        """Something has happened to these jobs."""
        self._rung += 1
        for job_id in job_ids:
            for bell in self._waiting.get(job_id, ()):
                bell.set()

    def ring_all(self) -> None:
        """Wakes everybody."""
        self.ring(list(self._waiting))

    async def wait(self, bell: asyncio.Event, longest: float) -> None:
        """Waits until the bell rings, at most for a time [s], and silences it."""
        try:
            async with asyncio.timeout(longest):
                await bell.wait()
        except TimeoutError:
            pass
        bell.clear()

    def listen(self, job_id: str) -> asyncio.Event:
        """A bell for a job, to be given back with `leave`."""
        bell = asyncio.Event()
        self._waiting[job_id].add(bell)
        return bell

    def leave(self, job_id: str, bell: asyncio.Event) -> None:
        """Gives a bell back."""
        self._waiting[job_id].discard(bell)
        if not self._waiting[job_id]:
            del self._waiting[job_id]

    async def shared(self, what: Hashable, read: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """The result of `read`, shared by concurrent callers with equal `what` until a change."""
        key = (what, self._rung)
        reading = self._reads.get(key)
        if reading is None:
            reading = self._reads[key] = asyncio.create_task(read())
            reading.add_done_callback(lambda done: self._has_read(key, done))
        found: T = await asyncio.shield(reading)
        return found

    def _has_read(self, key: Hashable, done: asyncio.Task[Any]) -> None:
        del self._reads[key]
        if not done.cancelled():
            done.exception()  # those who asked may have left by then
