"""POST /studies/{id}/iterations and GET /studies/{id}/iterations/{number}."""

from __future__ import annotations

from collections.abc import Coroutine
from functools import partial
from typing import Annotated, Any, TypeVar

import orjson
from fastapi import APIRouter, Path, Request, Response

from joulepath.app.access.client import check_owner
from joulepath.app.api.evaluate.task import EvaluateTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.shared.dependencies import ServiceCache, ServiceStore
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import CREATED_HEADERS, Key, StudyId, set_location
from joulepath.app.api.shared.problem_lists import MOTION_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.api.shared.uploads import upload, write
from joulepath.app.api.studies.iterations.task import (
    StudyStep,
    StudyStepTask,
    large_step,
    study_step,
)
from joulepath.app.engine.result import StoredAnswer, TaskResult
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import FieldError, InvalidRequest
from joulepath.app.exceptions.stored import KeyReused, StoreUnavailable, UnknownLog, UnknownStudy
from joulepath.app.exceptions.transport import UploadNotStored
from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.studies import IterationBody, IterationDetail
from joulepath.app.store import studies
from joulepath.app.store.cache import Answered, Asked
from joulepath.app.store.tables import Study
from joulepath.app.studies.answers import detail
from joulepath.app.tasks.answer_cache import AnswerCache
from joulepath.app.tasks.answer_collector import figures_of
from joulepath.app.tasks.read_body import HeldBody
from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.search.errors import PathInfeasible

T = TypeVar("T")
router = APIRouter(route_class=LargeBodyRoute, prefix="/studies", tags=["studies"])

MOST_ITERATIONS = 2**31 - 1
"""Largest iteration number of the database."""


@router.post(
    "/{id}/iterations",
    summary="Add an iteration",
    status_code=201,
    response_model=IterationDetail,
    responses={
        201: {"headers": CREATED_HEADERS},
        **problem_responses(
            *MOTION_PROBLEMS,
            PathInfeasible,
            InvalidTable,
            UnknownLog,
            KeyReused,
            UnknownStudy,
            NotOwner,
            StoreUnavailable,
            UploadNotStored,
        ),
    },
)
async def add_iteration(
    request: Request,
    response: Response,
    id: StudyId,
    body: IterationBody,
    tasks: ServiceTasks,
    cache: ServiceCache,
    key: Key = None,
) -> Any:
    """Computes the next iteration and stores the request and the complete answer. Returns its
    energy and the changes from the previous and the best iteration. A failed request returns its
    problem, and the study does not record it."""
    store, client = tasks.store, tasks.client
    study = (await store.read(partial(studies.state, study_id=id))).study
    check_owner(client, study.owner)
    step = await _step(body, study, tasks)
    known = await store.read(
        partial(studies.known_step, study_id=id, kind=step.kind, request=step.sent, key=key)
    )
    if known is None:
        made = await unless_disconnected(request, _located(step.kind, _made(step, tasks, cache)))
        number, again = await store.write(
            partial(studies.add, study_id=id, step=made, key=key, client=client)
        )
    else:
        number, again = known, True
    set_location(request, response, f"/studies/{id}/iterations/{number}", again)
    return detail(await store.read(partial(studies.entry, study_id=id, number=number)))


async def _step(body: IterationBody | HeldBody, study: Study, tasks: ServiceTasks) -> StudyStep:
    """Complete the request by the robot, figures and objective of the study.

    Raises:
        InvalidProblem: the request names another robot, other figures or another objective.
    """
    if not isinstance(body, HeldBody):
        return study_step(body, study.robot, study.figures, study.objective)
    task = StudyStepTask(body, study.robot, study.figures, study.objective, tasks.request_id)
    return large_step(await tasks.result(task))


async def _located(kind: str, work: Coroutine[Any, Any, T]) -> T:
    """Await `work`, and prefix the fields in its errors with their path in this request.

    Args:
        kind: name of the inner request, `optimize` or `evaluate`.
        work: the work on the inner request.
    """
    try:
        return await work
    except InvalidRequest as error:
        moved = [
            FieldError(loc=[each["loc"][0], kind, *each["loc"][1:]], msg=each["msg"])
            for each in error.errors
        ]
        raise InvalidRequest(moved) from None
    except InvalidProblem as error:
        raise InvalidProblem(f"{kind}.{error.field}", str(error)) from None


async def _made(step: StudyStep, tasks: ServiceTasks, cache: AnswerCache) -> studies.Step:
    """Compute the iteration by its endpoint, or copy the stored answer of an equal request."""
    request_id = tasks.request_id
    if step.optimize is None:
        with upload() as (file, path):
            write(file, step.evaluate)
            task = EvaluateTask(path, "json", {}, "json", request_id, tasks.deadline())
            return _iteration(step, await tasks.engine.run(task, tasks.deadline()))
    deadline = tasks.deadline(step.optimize)
    asked = await cache.asked("optimize", step.optimize, deadline)
    copy = await cache.copy(asked, request_id)
    if copy is not None:
        return _iteration(step, copy)
    made = await tasks.engine.run(OptimizeTask(step.optimize, request_id), deadline)
    return _iteration(step, made, asked)


@router.get(
    "/{id}/iterations/{number}",
    summary="One iteration of a study",
    response_model=IterationDetail,
    responses=problem_responses(InvalidRequest, UnknownStudy, StoreUnavailable),
)
async def show_iteration(
    id: StudyId,
    number: Annotated[
        int, Path(description="The iteration's number.", examples=[1], ge=1, le=MOST_ITERATIONS)
    ],
    store: ServiceStore,
) -> IterationDetail:
    """The request, its energy, and the state of the study after this iteration."""
    return detail(await store.read(partial(studies.entry, study_id=id, number=number)))


def _iteration(step: StudyStep, result: TaskResult, asked: Asked | None = None) -> studies.Step:
    """The iteration with a computed answer; `asked` is the key for later equal requests."""
    result = result if result.kept_as is not None else result.kept()
    assert result.kept_as is not None
    answer = orjson.loads(result.document)
    energy = answer["energy"] if step.kind == "optimize" else answer["total"]["energy"]
    stored = StoredAnswer(result.kept_as, result.document, figures_of(answer))
    return studies.Step(
        step.kind,
        step.sent,
        stored,
        answer["duration"],
        energy["electrical"]["total"],
        energy["mechanical"]["total"],
        None if asked is None else Answered(asked, stored.id, result.is_optimal),
    )
