"""Answers by the canonical form of their requests: what was computed once need not be computed again."""

from __future__ import annotations

import asyncio
import hashlib
from dataclasses import dataclass
from functools import partial
from typing import Any

import orjson

from app import __version__
from app.engine.result import TaskResult
from app.exceptions import StoreUnavailable
from app.schemas.common import Request
from app.store import cache
from app.store.cache import Asked
from app.store.store import Store
from app.store.tables import now
from app.tasks.arm_engine import own_figures
from app.tasks.read_body import HeldBody
from models.registry import robot_names
from optimizer.exceptions import UnknownRobot

PATIENCE = 0.25
"""Longest time [s] that a look into the database may take: what it may save is little more."""


@dataclass(frozen=True)
class AnswerCache:
    """The answers of one client in the database. With `by_passed` set, none is found; new ones are remembered."""

    store: Store
    owner: str | None
    by_passed: bool

    async def asked(self, kind: str, body: Request | HeldBody, deadline: float) -> Asked | None:
        """A validated request to the endpoint `kind`, as the cache knows it. None for one that it does not: too large,
        or of a robot that is not known.

        Two are the same if they have the same fields but for the deadline, defaults included, the same robot and the
        same client, and are for the same version of the service.
        """
        if isinstance(body, HeldBody) or self.store.fault is not None:
            return None
        content = body.model_dump(mode="json", exclude={"deadline"})
        robot: Any = content["robot"]
        if robot not in robot_names():
            try:
                robot = await own_figures(self.store, robot)
            except (UnknownRobot, StoreUnavailable):
                return None
        parts = [__version__, kind, self.owner, robot, content]
        return Asked(hashlib.sha256(orjson.dumps(parts, option=orjson.OPT_SORT_KEYS)).hexdigest(), deadline)

    async def find(self, asked: Asked | None, request_id: str) -> TaskResult | None:
        """A stored answer as that to the request with this id; None if there is none."""
        if asked is None or self.by_passed:
            return None
        try:
            async with asyncio.timeout(PATIENCE):
                found = await self.store.read(partial(cache.find, asked=asked))
        except (StoreUnavailable, TimeoutError):
            return None
        if found is None:
            return None
        created, document = found
        age = max(0, int((now() - created).total_seconds()))
        return TaskResult(document, "application/json", age=age).with_id(request_id)
