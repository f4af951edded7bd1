"""A cache of answers by the canonical form of their requests."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from functools import partial
from typing import Any

from sqlalchemy.orm import Session

from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.result import TaskResult
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

QUERY_TIMEOUT = 0.25
"""Longest time [s] of a query, in view of the time saved."""


@dataclass(frozen=True)
class AnswerCache:
    """The answers of one client in the database. With `by_passed`, answers are only stored."""

    store: Store
    owner: str | None
    by_passed: bool

    async def asked(self, kind: str, body: Request | HeldBody, deadline: float) -> Asked | None:
        """The key of a validated request to the endpoint `kind`.

        None for a request which is too large or names an unknown robot. Requests are equal if they
        have the same meaning, robot, client and version of the service.
        """
        if isinstance(body, HeldBody) or self.store.fault is not None:
            return None
        return await asked_for(self.store, meaning_of(kind, body), deadline, self.owner)

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
