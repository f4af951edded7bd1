"""POST and GET /identifications, GET, PATCH and DELETE /identifications/{id}, and its residuals."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Path, Query, Request, Response
from sqlalchemy.orm import Session

from joulepath.app.access.client import Client
from joulepath.app.api.identifications.models import (
    Identification,
    IdentificationList,
    IdentificationPage,
    IdentificationSummary,
    ListedIdentification,
    ResidualCurves,
)
from joulepath.app.api.identifications.request import IdentifyRequest
from joulepath.app.api.shared.dependencies import ServiceClient, ServiceJobs, ServiceStore
from joulepath.app.api.shared.parameters import CREATED_HEADERS, Key, set_location
from joulepath.app.convert.packed import unpacked
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import Busy
from joulepath.app.exceptions.stored import (
    KeyReused,
    StoreUnavailable,
    UnknownIdentification,
    UnknownJob,
    UnknownLog,
)
from joulepath.app.http.handlers import result_response
from joulepath.app.http.json_route import JsonRoute
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.examples.values import IDENTIFICATION_ID
from joulepath.app.schemas.queries import NewName
from joulepath.app.store import answers
from joulepath.app.store import jobs as stored_jobs
from joulepath.app.store import logs as stored_logs
from joulepath.app.store.tables import Figures, Job, JobRequest
from joulepath.app.tasks.job_body import Deadlines, job_of_one
from joulepath.app.tasks.job_request import IDENTIFY, RESIDUALS

router = APIRouter(prefix="/identifications", tags=["logs"], route_class=JsonRoute)

IdentificationId = Annotated[
    str, Path(description="The identification's id.", examples=[IDENTIFICATION_ID])
]
_STATES = {"waiting": "queued"}


@router.post(
    "",
    summary="Identify an arm's own figures from logs",
    status_code=202,
    response_model=Identification,
    responses={
        202: {"headers": CREATED_HEADERS},
        **problem_responses(
            InvalidRequest,
            UnknownLog,
            KeyReused,
            Busy,
            StoreUnavailable,
        ),
    },
)
async def add_identification(
    request: Request,
    response: Response,
    body: IdentifyRequest,
    jobs: ServiceJobs,
    store: ServiceStore,
    client: ServiceClient,
    key: Key = None,
) -> IdentificationSummary:
    """Finds friction, rotor inertia and power of one arm from its logs, with their prediction
    errors on held-out moves. The work is a job with the same id: see `GET /jobs/{id}`."""
    robots = set()
    for each in body.all_logs:
        robots.add((await store.read(partial(stored_logs.about, log_id=each))).robot)
    if len(robots) > 1:
        raise InvalidRequest([{"loc": ["body", "logs"], "msg": "All logs must be of one robot."}])
    new = job_of_one(IDENTIFY, body, Deadlines.of(jobs.settings))
    job_id, again = await jobs.create(new, key, client.owner)
    set_location(request, response, f"/identifications/{job_id}", again)
    return await _shown(store, job_id)


@router.get(
    "",
    summary="List identifications",
    response_model=IdentificationList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_identifications(
    page: Annotated[IdentificationPage, Query()], store: ServiceStore
) -> IdentificationList:
    """Identifications, newest first, page by page, with an optional search."""
    read = partial(_page, limit=page.limit, after=page.after, search=page.search)
    found, following = await store.read(read)
    return IdentificationList(identifications=found, next=following)


@router.get(
    "/{id}",
    summary="An identification",
    response_model=Identification,
    responses=problem_responses(UnknownIdentification, StoreUnavailable),
)
async def show_identification(id: IdentificationId, store: ServiceStore) -> IdentificationSummary:
    """The state of an identification and, once it is done, its result."""
    return await _shown(store, id)


@router.patch(
    "/{id}",
    summary="Name an identification",
    response_model=Identification,
    responses=problem_responses(InvalidRequest, UnknownIdentification, NotOwner, StoreUnavailable),
)
async def rename_identification(
    id: IdentificationId, body: NewName, store: ServiceStore, client: ServiceClient
) -> IdentificationSummary:
    """Gives the identification another name, or none."""
    await store.write(partial(_rename, job_id=id, name=body.name, client=client))
    return await _shown(store, id)


@router.delete(
    "/{id}",
    summary="Delete an identification",
    status_code=204,
    responses=problem_responses(UnknownIdentification, NotOwner, StoreUnavailable),
)
async def delete_identification(
    id: IdentificationId, jobs: ServiceJobs, store: ServiceStore, client: ServiceClient
) -> None:
    """Deletes an identification with its residuals, and stops it if it runs. The identified figures
    remain."""
    await store.read(partial(_found, job_id=id))
    await jobs.delete(id, client)


@router.get(
    "/{id}/residuals",
    summary="The residuals of an identification",
    response_model=ResidualCurves,
    responses=problem_responses(UnknownIdentification, StoreUnavailable),
)
async def identification_residuals(id: IdentificationId, store: ServiceStore) -> Response:
    """Measured and modelled torques and power over time, move by move. Held-out moves are predicted
    by a fit without them."""
    body = await store.read(partial(_curves, job_id=id))
    content = (
        {"id": id, "moves": None} if body is None else {"id": id, **orjson.loads(unpacked(body))}
    )
    return result_response(TaskResult.of_json(content))


async def _shown(store: ServiceStore, job_id: str) -> IdentificationSummary:
    content = await store.read(partial(_content, job_id=job_id))
    return Identification.model_validate_json(orjson.dumps(content))


def _content(session: Session, job_id: str) -> dict[str, Any]:
    """The fields of an identification. Raises UnknownIdentification."""
    job, request, body = _found(session, job_id)
    result = None if body is None else completed(orjson.loads(unpacked(body)))
    return _summary(session, job, request) | {"problem": request.problem, "result": result}


def completed(result: dict[str, Any]) -> dict[str, Any]:
    """The result, with empty lists for fields missing in results of earlier versions."""
    validation = result["validation"]
    if validation is not None:
        validation = {"energies": [], "cycles": []} | validation
    return {"measure": []} | result | {"validation": validation}


def _curves(session: Session, job_id: str) -> bytes | None:
    """The compressed curves of an identification, if it has any. Raises UnknownIdentification."""
    job, _, _ = _found(session, job_id)
    return answers.of_job(session, job.id, RESIDUALS)


def _rename(session: Session, job_id: str, name: str | None, client: Client) -> None:
    """Names an identification. Raises UnknownIdentification or NotOwner."""
    _found(session, job_id)
    stored_jobs.rename(session, job_id, name, client)


def _page(
    session: Session, limit: int, after: str | None, search: str | None
) -> tuple[list[ListedIdentification], str | None]:
    found, following = stored_jobs.page_of_kind(session, IDENTIFY, limit, after, search)
    listed = [
        ListedIdentification(**_summary(session, job, request), robot=robot)
        for job, request, robot in found
    ]
    return listed, following


def _found(session: Session, job_id: str) -> tuple[Job, JobRequest, bytes | None]:
    """The job of an identification, its request and the compressed answer. Raises
    UnknownIdentification.
    """
    try:
        job = stored_jobs.view(session, job_id).job
        request, body = stored_jobs.outcome(session, job_id, 0)
    except UnknownJob:
        raise UnknownIdentification from None
    if request.kind != IDENTIFY:
        raise UnknownIdentification
    return job, request, body


def _summary(session: Session, job: Job, request: JobRequest) -> dict[str, Any]:
    has_figures = request.figures is not None and session.get(Figures, request.figures) is not None
    return {
        "id": job.id,
        "name": job.name,
        "state": _STATES.get(request.state, request.state),
        "created": job.created,
        "owner": job.owner,
        "figures": request.figures if has_figures else None,
    }
