"""Routes of jobs: create, list, read, rename, delete, cancel, retry, events and results."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path, Query, Request, Response
from fastapi.responses import StreamingResponse

from joulepath.app.api.shared.dependencies import ServiceClient, ServiceJobs, ServiceStore
from joulepath.app.api.shared.parameters import (
    CREATED_HEADERS,
    Key,
    WantedFormat,
    is_fresh,
    set_location,
)
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.api.shared.uploads import received
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import Busy, ShuttingDown, WorkerLost
from joulepath.app.exceptions.stored import (
    JobNotCancellable,
    KeyReused,
    StoreUnavailable,
    UnknownJob,
)
from joulepath.app.exceptions.transport import (
    BodyTooLarge,
    RequestTimeout,
    UnsupportedMediaType,
    UploadNotStored,
)
from joulepath.app.http.event_stream import EVENT_SCHEMA, EVENT_STREAM, EVENT_STREAM_HEADERS
from joulepath.app.http.json_route import UNDECLARED, JsonRoute, media_type
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.weights import JSON
from joulepath.app.jobs.answers import as_csv, as_lines, detail, summary
from joulepath.app.jobs.events import ended_by, events_after
from joulepath.app.schemas.examples.values import JOB_ID, RESULTS_CSV, RESULTS_LINES
from joulepath.app.schemas.jobs import Job, JobDetail, JobList, JobPage, NewJob, RequestPage
from joulepath.app.schemas.queries import NewName
from joulepath.app.store import jobs as stored_jobs
from joulepath.app.tasks.job_body import Deadlines, JobBodyTask, Validated
from joulepath.app.tasks.job_request import IDENTIFY
from joulepath.optimizer.exceptions import DeadlineExceeded

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=JsonRoute)

JobId = Annotated[str, Path(description="The job's id.", examples=[JOB_ID])]
LastEventId = Annotated[
    str | None,
    Header(
        alias="Last-Event-ID",
        description="Number of the last event that was received. A text that is not a number "
        "has no effect.",
        examples=["17"],
    ),
]
_OF_ONE = (UnknownJob, StoreUnavailable)


@router.post(
    "",
    summary="Send a job",
    status_code=202,
    response_model=Job,
    responses={
        202: {"headers": CREATED_HEADERS},
        **problem_responses(
            InvalidRequest,
            KeyReused,
            BodyTooLarge,
            RequestTimeout,
            UnsupportedMediaType,
            UploadNotStored,
            Busy,
            ShuttingDown,
            DeadlineExceeded,
            WorkerLost,
            StoreUnavailable,
        ),
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": {"$ref": f"#/components/schemas/{NewJob.__name__}"}}
            },
        }
    },
)
async def create_job(
    request: Request,
    response: Response,
    tasks: ServiceTasks,
    jobs: ServiceJobs,
    key: Key = None,
) -> Job:
    """Accepts up to 10,000 requests and computes them in the background. All requests are
    validated before the response: a single malformed request refuses the whole job. The job
    survives a restart of the service. Requests with a waiting client run before those of jobs."""
    if media_type(request.headers) not in (JSON, *UNDECLARED):
        raise UnsupportedMediaType
    async with received(request) as (_, path):
        task = JobBodyTask(path, Deadlines.of(tasks.settings), tasks.request_id, is_fresh(request))
        result = await tasks.result(task)
    assert isinstance(result, Validated)
    job_id, again = await jobs.create(result.job, key, tasks.client.owner)
    set_location(request, response, f"/jobs/{job_id}", again)
    return Job(**summary(await jobs.view(job_id)))


@router.get(
    "",
    summary="List jobs",
    response_model=JobList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_jobs(page: Annotated[JobPage, Query()], store: ServiceStore) -> JobList:
    """Jobs with their progress, newest first, page by page. The query parameters select a
    state, search the names and leave out identifications."""
    without = None if page.identifications else IDENTIFY
    wanted = stored_jobs.Wanted(page.state, page.search, without)
    read = partial(stored_jobs.page, limit=page.limit, after=page.after, wanted=wanted)
    found, following = await store.read(read)
    return JobList(jobs=[Job(**summary(view)) for view in found], next=following)


@router.get(
    "/{id}",
    summary="A job and its requests",
    response_model=JobDetail,
    responses=problem_responses(InvalidRequest, *_OF_ONE),
)
async def show_job(
    id: JobId, page: Annotated[RequestPage, Query()], jobs: ServiceJobs, store: ServiceStore
) -> JobDetail:
    """The job with its progress and a page of its requests. A completed request refers to its
    answer, which is kept as long as the job; a failed request has its problem document."""
    view = await jobs.view(id)
    read = partial(stored_jobs.requests, job_id=id, limit=page.limit + 1, after=page.after)
    return JobDetail(**detail(view, await store.read(read), page.limit))


@router.patch(
    "/{id}",
    summary="Name a job",
    response_model=Job,
    responses=problem_responses(InvalidRequest, *_OF_ONE, NotOwner),
)
async def rename_job(id: JobId, body: NewName, store: ServiceStore, client: ServiceClient) -> Job:
    """Gives the job another name, or none."""
    rename = partial(stored_jobs.rename, job_id=id, name=body.name, client=client)
    return Job(**await store.write(lambda session: summary(rename(session))))


@router.delete(
    "/{id}",
    summary="Delete a job",
    status_code=204,
    responses=problem_responses(*_OF_ONE, NotOwner),
)
async def delete_job(id: JobId, jobs: ServiceJobs, client: ServiceClient) -> None:
    """Deletes the job with its answers. Running requests are stopped."""
    await jobs.delete(id, client)


@router.post(
    "/{id}/cancel",
    summary="Cancel a job",
    status_code=202,
    response_model=Job,
    responses=problem_responses(*_OF_ONE, NotOwner, JobNotCancellable),
)
async def cancel_job(id: JobId, jobs: ServiceJobs, client: ServiceClient) -> Job:
    """Cancels the waiting requests and stops the running requests within a second. Existing
    answers are kept. Cancelling a cancelled job has no effect."""
    await jobs.cancel(id, client)
    return Job(**summary(await jobs.view(id)))


@router.post(
    "/{id}/retry",
    summary="Retry a job",
    status_code=202,
    response_model=Job,
    responses=problem_responses(*_OF_ONE, NotOwner, Busy),
)
async def retry_job(id: JobId, jobs: ServiceJobs, client: ServiceClient) -> Job:
    """Queues the failed and cancelled requests again. Completed requests keep their answers."""
    await jobs.retry(id, client)
    return Job(**summary(await jobs.view(id)))


async def _known(id: JobId, jobs: ServiceJobs) -> str:
    # before the stream begins: a stream cannot become a problem
    view = await jobs.dispatcher.changes.shared(("view", id), partial(jobs.view, id))
    return view.job.id


KnownJob = Annotated[str, Depends(_known)]


@router.get(
    "/{id}/events",
    summary="Events of a job",
    response_class=StreamingResponse,
    responses={
        200: {"content": {EVENT_STREAM: {"itemSchema": EVENT_SCHEMA}}},
        204: {"description": "The job has ended, and no event follows `Last-Event-ID`."},
        **problem_responses(*_OF_ONE),
    },
)
async def job_events(
    job_id: KnownJob, jobs: ServiceJobs, store: ServiceStore, last: LastEventId = None
) -> Response:
    """Server-sent events: `state` (of the job), `request` (a request has ended), `progress` (at
    most two per second) and `end`. The events of a job are numbered from 1. `Last-Event-ID` resumes
    after a given number, also after a restart of the service. The stream closes when the job has
    ended."""
    number = int(last) if last is not None and last.isdecimal() and len(last) < 10 else 0
    # the status at which an EventSource of a browser does not connect again
    if number and await ended_by(store, job_id, number):
        return Response(status_code=204)
    # in batches, and not event by event as FastAPI has it: hundreds may follow one job
    found = events_after(store, jobs.dispatcher, job_id, number)
    return StreamingResponse(found, headers=EVENT_STREAM_HEADERS, media_type=EVENT_STREAM)


@router.get(
    "/{id}/results",
    summary="Results of a job",
    response_class=StreamingResponse,
    responses={
        200: {
            "content": {
                "application/x-ndjson": {"schema": {"type": "string"}, "example": RESULTS_LINES},
                "text/csv": {"schema": {"type": "string"}, "example": RESULTS_CSV},
            }
        },
        **problem_responses(*_OF_ONE),
    },
)
async def job_results(job_id: KnownJob, store: ServiceStore, wanted: WantedFormat) -> Response:
    """The ended requests in the order of their index: one line of JSON per request, with the
    complete answer under `result`. `Accept: text/csv` returns a table of their figures without the
    answers."""
    if wanted == "csv":
        return StreamingResponse(as_csv(store, job_id), media_type="text/csv")
    return StreamingResponse(as_lines(store, job_id), media_type="application/x-ndjson")
