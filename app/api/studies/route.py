"""POST /studies, GET /studies, GET, PATCH and DELETE /studies/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from joulepath.app.api.shared.dependencies import ServiceClient, ServiceStore
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import (
    CREATED_HEADERS,
    Key,
    StudyId,
    WantedFormat,
    set_location,
)
from joulepath.app.convert.robots import with_figures
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import ShuttingDown, WorkerLost
from joulepath.app.exceptions.stored import (
    KeyReused,
    StoreUnavailable,
    UnknownFigures,
    UnknownStudy,
)
from joulepath.app.exceptions.transport import BodyTooLarge, RequestTimeout
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.examples.values import STUDY_CSV
from joulepath.app.schemas.studies import (
    Study,
    StudyList,
    StudyName,
    StudyPage,
    StudyRequest,
    StudySummary,
)
from joulepath.app.store import studies
from joulepath.app.studies.answers import as_csv, full, summary
from joulepath.app.tasks.arm_engine import known_here, robot_in
from joulepath.optimizer.exceptions import DeadlineExceeded, UnknownRobot

router = APIRouter(prefix="/studies", tags=["studies"], route_class=LargeBodyRoute)


@router.post(
    "",
    summary="Begin a study",
    status_code=201,
    response_model=StudySummary,
    responses={
        201: {"headers": CREATED_HEADERS},
        **problem_responses(
            InvalidRequest,
            KeyReused,
            UnknownRobot,
            UnknownFigures,
            BodyTooLarge,
            RequestTimeout,
            ShuttingDown,
            DeadlineExceeded,
            WorkerLost,
            StoreUnavailable,
        ),
    },
)
async def create_study(
    request: Request,
    response: Response,
    body: StudyRequest,
    store: ServiceStore,
    client: ServiceClient,
    key: Key = None,
) -> StudySummary:
    """Begins a study: the step-by-step improvement of a motion until its energy is at most
    `threshold`.
    """
    robot = await robot_in(store, body.robot)
    if body.figures is not None:
        with await known_here(store, body.robot, body.figures):
            with_figures(robot, body.figures)
    study = studies.new_study(
        body.name, body.robot, body.objective, body.threshold, key, client.owner, body.figures
    )
    made, again = await store.create(partial(studies.create, study=study))
    set_location(request, response, f"/studies/{made.id}", again)
    return StudySummary(**summary(await store.read(partial(studies.state, study_id=made.id))))


@router.get(
    "",
    summary="List studies",
    response_model=StudyList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_studies(page: Annotated[StudyPage, Query()], store: ServiceStore) -> StudyList:
    """Studies with their state, newest first, page by page, with an optional search."""
    read = partial(studies.page, limit=page.limit, after=page.after, search=page.search)
    found, following = await store.read(read)
    return StudyList(studies=[StudySummary(**summary(state)) for state in found], next=following)


@router.get(
    "/{id}",
    summary="A study and its history",
    response_model=Study,
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": STUDY_CSV}}},
        **problem_responses(UnknownStudy, StoreUnavailable),
    },
)
async def show_study(id: StudyId, wanted: WantedFormat, store: ServiceStore) -> Response:
    """The study with its iterations: energy, change from the previous and from the best iteration,
    and whether the threshold is met. `Accept: text/csv` returns the history as a table."""
    history = await store.read(partial(studies.history, study_id=id))
    if wanted == "csv":
        return Response(await run_in_threadpool(as_csv, history), media_type="text/csv")
    return Response(await run_in_threadpool(_document, history), media_type="application/json")


@router.patch(
    "/{id}",
    summary="Name a study",
    response_model=StudySummary,
    responses=problem_responses(InvalidRequest, UnknownStudy, NotOwner, StoreUnavailable),
)
async def rename_study(
    id: StudyId, body: StudyName, store: ServiceStore, client: ServiceClient
) -> StudySummary:
    """Gives the study another name."""
    rename = partial(studies.rename, study_id=id, name=body.name, client=client)
    return StudySummary(**await store.write(lambda session: summary(rename(session))))


@router.delete(
    "/{id}",
    summary="Delete a study",
    status_code=204,
    responses=problem_responses(UnknownStudy, NotOwner, StoreUnavailable),
)
async def delete_study(id: StudyId, store: ServiceStore, client: ServiceClient) -> None:
    """Deletes the study with its iterations and their answers."""
    await store.write(partial(studies.delete, study_id=id, client=client), frees=True)


def _document(history: studies.History) -> str:
    return Study(**full(history)).model_dump_json()
