"""Equal concurrent requests are computed once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import ServiceError
from joulepath.app.exceptions.queue import WorkerLost
from joulepath.app.store.cache import Asked

Compute = Callable[[float], Coroutine[Any, Any, TaskResult]]
"""Computes an answer, with so much time [s]."""


@dataclass(eq=False)
class _Work:
    computing: asyncio.Task[TaskResult]
    waiting: int = 0


class InFlight:
    """Running computations of this service by their requests."""

    def __init__(self) -> None:
        self._works: dict[Asked, _Work] = {}

    async def result(self, asked: Asked, compute: Compute) -> tuple[TaskResult, bool]:
        """The answer to a request, and whether it was computed for an equal one.

        Equal requests have the same deadline. The computation continues while any request waits,
        and its errors are raised. If the computation for another request fails because of the
        service, this request is computed again, unless the computation has ended workers.
        """
        loop = asyncio.get_running_loop()
        end = loop.time() + asked.deadline
        if (known := self._works.get(asked)) is not None:
            try:
                return await self._awaited(asked, known), True
            except WorkerLost:
                raise  # it would die of this one, too
            except ServiceError:
                return await compute(end - loop.time()), False
        work = self._works[asked] = _Work(asyncio.create_task(compute(asked.deadline)))
        work.computing.add_done_callback(lambda _: self._forget(asked, work))
        return await self._awaited(asked, work), False

    async def _awaited(self, asked: Asked, work: _Work) -> TaskResult:
        work.waiting += 1
        try:
            return await asyncio.shield(work.computing)
        finally:
            work.waiting -= 1
            if not work.waiting:
                # New requests must not wait for a stopped computation.
                self._forget(asked, work)
                work.computing.cancel()

    def _forget(self, asked: Asked, work: _Work) -> None:
        if self._works.get(asked) is work:
            del self._works[asked]
