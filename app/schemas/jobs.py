"""Requests and responses of the routes under `/jobs`."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Tag

from joulepath.app.api.compare.task import CompareRequest
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.pareto.task import ParetoRequest
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.whatif.task import WhatifRequest
from joulepath.app.schemas.common import Request, Response, by_field, described, part
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.examples.values import ANSWER_PATH, CREATED, EVALUATE, JOB_ID, OPTIMIZE
from joulepath.app.schemas.queries import Name, Query, after_of, limit_of, next_of, search_in
from joulepath.app.schemas.request import OptimizeRequest

MOST_REQUESTS = 10_000
"""Most requests of one job."""
JobState = Literal["waiting", "running", "done", "cancelling", "cancelled"]
RequestState = Literal["waiting", "running", "done", "failed", "cancelled"]
Kind = Literal[
    "optimize", "cycle", "placement", "pareto", "compare", "whatif", "evaluate", "identify"
]


class NamedRequest(Request):
    """A request of a job, beside the name of its row."""

    name: Name | None = described(
        "Name of the request in the job's table, CSV and report.",
        None,
        "bin to shelf",
        default=None,
    )


class OptimizeJob(NamedRequest):
    """A request to `POST /optimize`."""

    optimize: OptimizeRequest = described("A body of `POST /optimize`.", None, OPTIMIZE)


class CycleJob(NamedRequest):
    """A request to `POST /cycle`."""

    cycle: CycleRequest = part("A body of `POST /cycle`.")


class PlacementJob(NamedRequest):
    """A request to `POST /placement`."""

    placement: PlacementRequest = part("A body of `POST /placement`.")


class ParetoJob(NamedRequest):
    """A request to `POST /pareto`."""

    pareto: ParetoRequest = described("A body of `POST /pareto`.", None, OPTIMIZE)


class CompareJob(NamedRequest):
    """A request to `POST /compare`."""

    compare: CompareRequest = described("A body of `POST /compare`.", None, OPTIMIZE)


class WhatifJob(NamedRequest):
    """A request to `POST /whatif`."""

    whatif: WhatifRequest = part("A body of `POST /whatif`.")


class EvaluateJob(NamedRequest):
    """A request to `POST /evaluate`."""

    evaluate: EvaluateRequest = described("A JSON body of `POST /evaluate`.", None, EVALUATE)


KINDS = ("optimize", "cycle", "placement", "pareto", "compare", "whatif", "evaluate")
RequestOfJob = Annotated[
    Annotated[OptimizeJob, Tag("by optimize")]
    | Annotated[CycleJob, Tag("by cycle")]
    | Annotated[PlacementJob, Tag("by placement")]
    | Annotated[ParetoJob, Tag("by pareto")]
    | Annotated[CompareJob, Tag("by compare")]
    | Annotated[WhatifJob, Tag("by whatif")]
    | Annotated[EvaluateJob, Tag("by evaluate")],
    by_field(*KINDS),
]


class NewJob(Request):
    """Requests computed in the background."""

    requests: list[RequestOfJob] = described(
        "The requests, in any mixture. `deadline` counts from the start of the work on a "
        "request. It may exceed the deadline of a synchronous request, up to "
        "`JOULEPATH_MAX_JOB_DEADLINE`.",
        None,
        [{"optimize": OPTIMIZE}, {"evaluate": EVALUATE}],
        min_length=1,
        max_length=MOST_REQUESTS,
    )
    name: Name | None = described("Name of the job.", None, "Night run, cell 4", default=None)
    keep_going: bool = described(
        "Whether the other requests continue after one has failed. If not, the first failure "
        "cancels them.",
        None,
        True,
        default=True,
    )


class Counts(Response):
    """Number of requests by state."""

    waiting: int = described("Wait for a worker.", "1", 1)
    running: int = described("Handed out to workers.", "1", 1)
    done: int = described("Answered.", "1", 7)
    failed: int = described("Ended with a problem.", "1", 1)
    cancelled: int = described("Cancelled before they were answered.", "1", 0)


class Job(Response):
    """A job and its progress."""

    id: str = described("Id of the job.", None, JOB_ID)
    name: str | None = described("Name of the job.", None, "Night run, cell 4")
    state: JobState = described(
        "`done`: every request has ended. `cancelling`: what runs is being stopped.",
        None,
        "running",
    )
    created: datetime = described("Time at which it was sent, in UTC.", None, CREATED)
    started: datetime | None = described(
        "Time at which work on it began, in UTC; null before.", None, CREATED
    )
    ended: datetime | None = described(
        "Time at which its last request ended, in UTC; null before.", None, None
    )
    owner: str | None = described(
        "Name of the API key that sent it; null without one.", None, "press_shop"
    )
    counts: Counts = part("How many of its requests are in each state.")
    progress: float = described("Share of the requests that have ended.", "1", 0.8)
    eta: float | None = described(
        "Time until it ends at its present speed; null before 5 % of its requests have ended, and "
        "after its end.",
        "s",
        12.5,
    )


class RequestStatus(Response):
    """One request of a job."""

    index: int = described("Index in the job, from 0.", "1", 3)
    name: str | None = described("Name of the request; null without one.", None, "bin to shelf")
    kind: Kind = described("Endpoint of the request.", None, "optimize")
    state: RequestState = described("State of the request.", None, "done")
    attempt: int = described(
        "How often work on it began. A worker that dies, or a service that stops, begins again.",
        "1",
        1,
    )
    wall_time: float | None = described(
        "Time that the last work on it took; null before its end.", "s", 0.21
    )
    energy: float | None = described(
        "Energy of the motion, the cycle or the best place that answers it, of its objective "
        "(electrical for "
        "`evaluate`). Null for other kinds, and without an answer.",
        "J",
        57.5,
    )
    duration: float | None = described(
        "Duration of that motion or cycle; null as `energy`.", "s", 1.33
    )
    status: str | None = described("`status` of the answer; null if it has none.", None, "optimal")
    answer: str | None = described(
        "Path of the complete answer. It is kept as long as the job. Null without an answer.",
        None,
        ANSWER_PATH,
    )
    problem: dict[str, Any] | None = described(
        "Why it failed: the problem (RFC 9457) that its endpoint would have answered. Null if it "
        "did not fail.",
        None,
        {"type": "/problems/duration-too-short", "title": "Duration too short", "status": 422},
    )


class JobDetail(Job):
    """A job and a page of its requests."""

    requests: list[RequestStatus] = part("Requests in order of their index.")
    next: int | None = described(
        "Value of `after` for the next page; null on the last page.", "1", 99
    )


class JobList(Response):
    """Jobs, newest first."""

    jobs: list[Job] = part("The jobs.")
    next: str | None = next_of(JOB_ID)


class JobPage(Query):
    """The requested part of the list of jobs."""

    limit: int = limit_of("jobs")
    after: str | None = after_of(JOB_ID)
    state: JobState | None = described(
        "Only jobs in this state. Null: all.", None, "running", default=None
    )
    search: Name | None = search_in("the name")
    identifications: bool = described(
        "Whether the list includes identifications, which are jobs as well.",
        None,
        True,
        default=True,
    )


class RequestPage(Query):
    """The requested part of a job's requests."""

    limit: int = described(
        "Largest number of requests in the answer.", "1", 100, default=100, ge=1, le=1000
    )
    after: int = described(
        "Value of `next` on the previous page. -1: the first page.",
        "1",
        99,
        default=-1,
        ge=-1,
        le=MOST_REQUESTS,
    )
