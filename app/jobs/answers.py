"""Answers about a job: its state, its requests, their results line by line."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import orjson

from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.result import csv_document, path_of_answer
from joulepath.app.http.problems import PREFIX
from joulepath.app.store import jobs
from joulepath.app.store.job_events import eta, progress
from joulepath.app.store.jobs import JobView
from joulepath.app.store.store import Store
from joulepath.app.store.tables import JobRequest, now


@dataclass(frozen=True)
class PageSettings:
    """Sizes of reads."""

    results: int = 20
    """Results read at a time: an answer may have a hundred kilobytes."""
    rows: int = 1000
    """Rows of a table read at a time."""


PAGES = PageSettings()

_COLUMNS = (
    "index",
    "name",
    "kind",
    "state",
    "attempt",
    "wall_time_s",
    "energy_J",
    "duration_s",
    "status",
    "answer",
    "problem",
)


def summary(view: JobView) -> dict[str, Any]:
    """The fields of a job."""
    job, counts = view.job, view.counts
    names = ("id", "name", "state", "created", "started", "ended", "owner")
    own = {name: getattr(job, name) for name in names}
    return own | {
        "counts": counts,
        "progress": progress(job, counts),
        "eta": eta(job, counts, now()),
    }


def status(request: JobRequest) -> dict[str, Any]:
    """The fields of a request of a job."""
    names = ("name", "kind", "state", "attempt", "wall_time", "energy", "duration", "status")
    answer = None if request.answer_id is None else path_of_answer(request.answer_id)
    own = {name: getattr(request, name) for name in names}
    return {"index": request.number, **own, "answer": answer, "problem": request.problem}


def detail(view: JobView, requests: Sequence[JobRequest], limit: int) -> dict[str, Any]:
    """The fields of a job and of the first `limit` of some of its requests."""
    shown = requests[:limit]
    following = shown[-1].number if len(requests) > limit else None
    return summary(view) | {"requests": [status(request) for request in shown], "next": following}


async def as_lines(store: Store, job_id: str) -> AsyncIterator[bytes]:
    """The ended requests of a job by index: one line of JSON per request, with its answer."""
    last = -1
    while found := await store.read(
        partial(jobs.results, job_id=job_id, limit=PAGES.results, after=last)
    ):
        last = found[-1][0].number
        yield await asyncio.to_thread(_lines, found)


async def as_csv(store: Store, job_id: str) -> AsyncIterator[bytes]:
    """The ended requests of a job by index, as a table of their figures."""
    yield csv_document([_COLUMNS])
    last = -1
    while found := await store.read(
        partial(jobs.ended, job_id=job_id, limit=PAGES.rows, after=last)
    ):
        last = found[-1].number
        yield csv_document([_row(request) for request in found])


def _lines(found: Sequence[tuple[JobRequest, bytes | None]]) -> bytes:
    return b"".join(_line(request, body) for request, body in found)


def _line(request: JobRequest, body: bytes | None) -> bytes:
    result = None if body is None else orjson.Fragment(unpacked(body))
    return orjson.dumps(status(request) | {"result": result}, option=orjson.OPT_APPEND_NEWLINE)


def _row(request: JobRequest) -> list[Any]:
    own = status(request)
    problem = None if request.problem is None else request.problem["type"].removeprefix(PREFIX)
    return list((own | {"problem": problem}).values())
