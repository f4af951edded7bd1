"""POST /studies, GET /studies, GET and DELETE /studies/{id}."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.exc import IntegrityError

from app.convert.arm import robot_named
from app.http.openapi import problem_responses
from app.routes.parameters import CREATED_HEADERS, Key, StudyId, set_location
from app.schemas import errors as problems
from app.schemas.examples.studies import STUDY_CSV
from app.schemas.studies import Study, StudyList, StudyPage, StudyRequest, StudySummary
from app.store import studies
from app.store.store import Store
from app.studies.answers import as_csv, full, summary

router = APIRouter(prefix="/studies", tags=["studies"])


@router.post(
    "",
    summary="Begin a study",
    status_code=201,
    response_model=StudySummary,
    responses={
        201: {"headers": CREATED_HEADERS},
        **problem_responses(
            problems.Validation,
            problems.KeyReused,
            problems.UnknownRobot,
            problems.BodyTooLarge,
            problems.StoreUnavailable,
        ),
    },
)
async def create(
    request: Request,
    response: Response,
    body: StudyRequest,
    key: Key = None,
) -> StudySummary:
    """Begins a study: a motion to be improved step by step until its energy is at most `threshold`."""
    robot_named(body.robot)
    store: Store = request.app.state.store
    study = studies.new_study(body.name, body.robot, body.objective, body.threshold, key)
    try:
        made, again = await store.write(partial(studies.create, study=study))
    except IntegrityError:  # the same request, elsewhere at the same time, was first
        made, again = await store.write(partial(studies.create, study=study))
    set_location(request, response, made.id, again)
    return StudySummary(**summary(await store.read(partial(studies.history, study_id=made.id))))


@router.get(
    "",
    summary="List studies",
    response_model=StudyList,
    responses=problem_responses(problems.Validation, problems.StoreUnavailable),
)
async def list_studies(request: Request, page: Annotated[StudyPage, Query()]) -> StudyList:
    """Studies and how far each has come, newest first, page by page."""
    store: Store = request.app.state.store
    found, following = await store.read(partial(studies.page, limit=page.limit, after=page.after))
    return StudyList(studies=[StudySummary(**summary(history)) for history in found], next=following)


@router.get(
    "/{id}",
    summary="A study and its history",
    response_model=Study,
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": STUDY_CSV}}},
        **problem_responses(problems.UnknownStudy, problems.StoreUnavailable),
    },
)
async def show(request: Request, id: StudyId) -> Response:
    """Its iterations, each against the one before and the best, and whether the threshold is met. `Accept: text/csv`
    gives the history as a table."""
    store: Store = request.app.state.store
    history = await store.read(partial(studies.history, study_id=id))
    if "text/csv" in request.headers.get("accept", "").lower():
        return Response(as_csv(history), media_type="text/csv")
    return Response(Study(**full(history)).model_dump_json(), media_type="application/json")


@router.delete(
    "/{id}",
    summary="Delete a study",
    status_code=204,
    responses=problem_responses(problems.UnknownStudy, problems.StoreUnavailable),
)
async def delete(request: Request, id: StudyId) -> None:
    """Deletes it with its iterations and their answers."""
    store: Store = request.app.state.store
    await store.write(partial(studies.delete, study_id=id))
