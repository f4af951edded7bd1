"""Copies of known answers for requests of jobs, and known motions for the others."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
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


async def sort(store: Store, held: Sequence[Held]) -> Sorted:
    """Divides leased requests into those to be computed and those with a known answer. Cycles get
    the known motions of their cells. Raises StoreUnavailable.
    """
    began = time.perf_counter()
    for each in held:
        each.asked = await _asked(store, each)
    asked = [each.asked for each in held if each.asked is not None]
    found = await store.read(partial(cache.find, asked=asked)) if asked else {}
    hits = [
        (each, found[each.asked]) for each in held if each.asked is not None and each.asked in found
    ]
    known = await asyncio.to_thread(_copies, hits, began) if hits else {}
    to_compute = [each for each in held if each not in known]
    for each in to_compute:
        await _recall(store, each)
    return Sorted(to_compute, known)


async def _recall(store: Store, held: Held) -> None:
    """Gives a cycle the known motions of its cell."""
    meaning = held.lease.meaning
    if held.asked is not None and meaning is not None and "cell" in meaning:
        with suppress(StoreUnavailable):
            held.motions = await store.read(partial(known_motions.find, cell=meaning["cell"]))


async def _asked(store: Store, held: Held) -> Asked | None:
    lease = held.lease
    # Another version may have interpreted the request differently.
    if lease.meaning is None or lease.meaning["version"] != VERSION:
        return None
    job_id = None if lease.kind in ALONE else lease.job_id
    return await asked_for(store, lease.meaning, lease.deadline, lease.owner, job_id)


def _copies(hits: Iterable[tuple[Held, Answer]], began: float) -> dict[Held, Outcome]:
    return {held: _copy(held, answer, began) for held, answer in hits}


def _copy(held: Held, answer: Answer, began: float) -> Outcome:
    figures = AnswerFigures(answer.robot, answer.energy, answer.duration, answer.status)
    result = TaskResult(unpacked(answer.body), "application/json", kept_as=answer.id)
    copy = result.copied(request_id_of(held.lease))
    document = packed(copy.document)
    return Outcome(held.lease, "done", time.perf_counter() - began, figures, document, copy.kept_as)
