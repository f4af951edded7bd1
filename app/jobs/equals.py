"""Equal requests of jobs: computed once, and answered by copies."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.jobs.heap import Held
from joulepath.app.jobs.work import request_id_of
from joulepath.app.store import cache, known_motions
from joulepath.app.store.cache import Asked
from joulepath.app.store.leases import Outcome
from joulepath.app.store.store import Store
from joulepath.app.store.tables import Answer
from joulepath.app.tasks.answer_cache import asked_for
from joulepath.app.tasks.request_key import VERSION

ALONE = ("optimize", "compare", "evaluate")
"""Endpoints with self-contained answers; others refer to answers kept as long as their job."""


@dataclass(frozen=True)
class Sorted:
    """Leased requests to be computed, and known outcomes of others."""

    to_compute: Sequence[Held]
    known: Mapping[Held, Outcome]


class Equals:
    """Requests waiting for an equal request; `released` returns them after its answer is stored."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._followers: dict[str, list[Held]] = {}
        self._released: list[Held] = []

    @property
    def waiting(self) -> int:
        """Number of waiting requests."""
        return sum(map(len, self._followers.values())) + len(self._released)

    async def sort(self, held: Sequence[Held]) -> Sorted:
        """Divides requests into new, known and waiting ones. Raises StoreUnavailable."""
        began = time.perf_counter()
        for each in held:
            each.asked = await self._asked(each)
        asked = [each.asked for each in held if each.asked is not None]
        found = await self._store.read(partial(cache.find, asked=asked)) if asked else {}
        hits = [
            (each, found[each.asked])
            for each in held
            if each.asked is not None and each.asked in found
        ]
        known = await asyncio.to_thread(_copies, hits, began) if hits else {}
        to_compute = [each for each in held if each not in known and not self._follows(each)]
        for each in to_compute:
            await self._recall(each)
        return Sorted(to_compute, known)

    async def _recall(self, held: Held) -> None:
        """Gives a cycle the known motions of its cell."""
        meaning = held.lease.meaning
        if held.asked is not None and meaning is not None and "cell" in meaning:
            with suppress(StoreUnavailable):
                held.motions = await self._store.read(
                    partial(known_motions.find, cell=meaning["cell"])
                )

    def ended(self, held: Held, outcome: Outcome) -> list[tuple[Held, Outcome]]:
        """Pass the outcome of an ended request on to the requests waiting for it.

        Returns:
            Outcomes of the waiting requests if the request failed by an error of its own; empty if
            they must compute or read the answer, see `released`.
        """
        if held.asked is None or not held.leads:
            return []
        held.leads = False
        followers = self._followers.pop(held.asked.key)
        problem = outcome.problem
        if outcome.state != "failed" or problem is None or problem["status"] >= 500:
            self._released += followers
            return []
        # The error is in the request itself.
        return [
            (
                each,
                replace(
                    outcome,
                    lease=each.lease,
                    problem=problem | {"instance": request_id_of(each.lease)},
                ),
            )
            for each in followers
        ]

    def released(self) -> list[Held]:
        """Remove and return the requests with a stored answer, and dropped requests."""
        for key, followers in self._followers.items():
            self._released += [each for each in followers if each.dropped]
            self._followers[key] = [each for each in followers if not each.dropped]
        released, self._released = self._released, []
        return released

    def _follows(self, held: Held) -> bool:
        """Whether the request waits for an equal request. If not, it becomes the leader."""
        if held.asked is None:
            return False
        followers = self._followers.get(held.asked.key)
        if followers is None:
            self._followers[held.asked.key] = []
            held.leads = True
            return False
        followers.append(held)
        return True

    async def _asked(self, held: Held) -> Asked | None:
        lease = held.lease
        # Another version may have interpreted the request differently.
        if lease.meaning is None or lease.meaning["version"] != VERSION:
            return None
        job_id = None if lease.kind in ALONE else lease.job_id
        return await asked_for(self._store, lease.meaning, lease.deadline, lease.owner, job_id)


def _copies(hits: Iterable[tuple[Held, Answer]], began: float) -> dict[Held, Outcome]:
    return {held: _copy(held, answer, began) for held, answer in hits}


def _copy(held: Held, answer: Answer, began: float) -> Outcome:
    figures = AnswerFigures(answer.robot, answer.energy, answer.duration, answer.status)
    result = TaskResult(unpacked(answer.body), "application/json", kept_as=answer.id)
    copy = result.copied(request_id_of(held.lease))
    document = packed(copy.document)
    return Outcome(held.lease, "done", time.perf_counter() - began, figures, document, copy.kept_as)
