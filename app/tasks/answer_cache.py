"""A cache of answers by the canonical form of their requests, also of those being computed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from sqlalchemy.orm import Session

from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import ServiceError
from joulepath.app.exceptions.queue import WorkerLost
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.schemas.common import Request
from joulepath.app.store import cache, known_motions
from joulepath.app.store.cache import Asked, Meaning
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Answer, now
from joulepath.app.tasks.arm_engine import own_figures
from joulepath.app.tasks.read_body import HeldBody
from joulepath.app.tasks.request_key import key_of, meaning_of
from joulepath.models.registry import robot_names
from joulepath.optimizer.exceptions import UnknownRobot

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


QUERY_TIMEOUT = 0.25
"""Longest time [s] of a query, in view of the time saved."""


@dataclass(frozen=True)
class AnswerCache:
    """The answers of one client in the database. With `by_passed`, answers are only stored."""

    store: Store
    owner: str | None
    by_passed: bool
    in_flight: InFlight = field(default_factory=InFlight)

    async def asked(self, kind: str, body: Request | HeldBody, deadline: float) -> Asked | None:
        """The key of a validated request to the endpoint `kind`.

        None for a request which is too large or names an unknown robot. Requests are equal if they
        have the same meaning, robot, client and version of the service.
        """
        if isinstance(body, HeldBody) or self.store.fault is not None:
            return None
        return await asked_for(self.store, meaning_of(kind, body), deadline, self.owner)

    async def answer(
        self,
        asked: Asked | None,
        request_id: str,
        deadline: float,
        compute: Compute,
        is_heard: bool,
    ) -> TaskResult:
        """The answer to a request: a stored one, a running equal one, or the result of `compute`.

        `compute` has `deadline` [s], and its errors are raised. `is_heard`: a client listens to its
        events.
        """
        if asked is None or self.by_passed or is_heard:
            known = await self.find(asked, request_id)
            return await compute(deadline) if known is None else known

        async def find_or_compute(left: float) -> TaskResult:
            return await self._find(asked) or await compute(left)

        # an equal request that ends between a look at the store and the computation is not missed
        result, is_anothers = await self.in_flight.result(asked, find_or_compute)
        if result.age is None and not is_anothers:
            return result
        return replace(result, age=result.age or 0).for_request(request_id)

    async def motions(self, cell: str | None) -> dict[str, bytes]:
        """Known motions of a cell by their keys; none for an unknown cell.

        All clients share them, since answers do not depend on them.
        """
        if cell is None or self.by_passed or self.store.fault is not None:
            return {}
        try:
            async with asyncio.timeout(QUERY_TIMEOUT):
                return await self.store.read(partial(known_motions.find, cell=cell))
        except (StoreUnavailable, TimeoutError):
            return {}

    async def find(self, asked: Asked | None, request_id: str) -> TaskResult | None:
        """A stored answer with the id of this request; None without one."""
        found = await self._find(asked)
        return None if found is None else found.for_request(request_id)

    async def copy(self, asked: Asked | None, request_id: str) -> TaskResult | None:
        """The same, to be kept as another answer."""
        found = await self._find(asked)
        return None if found is None else found.copied(request_id)

    async def _find(self, asked: Asked | None) -> TaskResult | None:
        if asked is None or self.by_passed:
            return None
        try:
            async with asyncio.timeout(QUERY_TIMEOUT):
                known = await self.store.read(partial(_with_document, asked=asked))
        except (StoreUnavailable, TimeoutError):
            return None
        if known is None:
            return None
        answer, document = known
        age = max(0, int((now() - answer.created).total_seconds()))
        return TaskResult(document, "application/json", kept_as=answer.id, age=age)


def _with_document(session: Session, asked: Asked) -> tuple[Answer, bytes] | None:
    answer = cache.find(session, [asked]).get(asked)
    return None if answer is None else (answer, unpacked(answer.body))


async def asked_for(
    store: Store, meaning: Meaning, deadline: float, owner: str | None, job_id: str | None = None
) -> Asked | None:
    """A request of a client as the cache knows it; None if its robot is not known. With a `job_id`,
    no request of another job is the same."""
    own: dict[str, Any] | None = None
    if meaning["robot"] not in robot_names():
        try:
            own = await own_figures(store, meaning["robot"])
        except (UnknownRobot, StoreUnavailable):
            return None
    return Asked(key_of(meaning, owner, own, job_id), deadline)
