"""POST /studies/{id}/iterations and GET /studies/{id}/iterations/{number}."""

from __future__ import annotations

from collections.abc import Coroutine
from functools import partial
from typing import Annotated, Any, TypeVar

import orjson
from fastapi import APIRouter, Body, Path, Request, Response

from app.access.rules import check_owner
from app.engine.result import TaskResult
from app.exceptions import InvalidRequest
from app.http.disconnect import unless_disconnected
from app.http.json_route import JsonRoute
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceArmEngine, ServiceClient, ServiceSettings, ServiceStore
from app.routes.parameters import CREATED_HEADERS, Key, StudyId, deadline_of, set_location
from app.routes.problem_lists import MOTION_PROBLEMS
from app.routes.uploads import upload
from app.schemas import errors as problems
from app.schemas.evaluate import EvaluateRequest
from app.schemas.request import OptimizeRequest
from app.schemas.studies import IterationDetail, IterationRequest, OptimizeStep
from app.store import studies
from app.store.tables import Study
from app.studies.answers import detail
from app.tasks.arm_engine import ArmEngine
from app.tasks.evaluate import EvaluateTask
from app.tasks.optimize import OptimizeTask
from optimizer.exceptions import InvalidProblem, InvalidTable, OutsideLimits

R = TypeVar("R", OptimizeRequest, EvaluateRequest)

router = APIRouter(route_class=JsonRoute, prefix="/studies", tags=["studies"])

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
            problems.PathInfeasible,
            problems.InvalidTable,
            problems.KeyReused,
            problems.UnknownStudy,
            problems.NotOwner,
            problems.StoreUnavailable,
        ),
    },
)
async def add(
    request: Request,
    response: Response,
    id: StudyId,
    body: Annotated[IterationRequest, Body()],
    settings: ServiceSettings,
    engine: ServiceArmEngine,
    store: ServiceStore,
    client: ServiceClient,
    key: Key = None,
) -> Any:
    """Computes the next iteration and stores the request and the complete answer. Returns its energy and the changes
    from the previous and the best iteration. A failed request returns its problem, and the study does not record it."""
    study = (await store.read(partial(studies.state, study_id=id))).study
    check_owner(client, study.owner)
    kind, asked = _completed(body, study)
    sent = asked.model_dump(mode="json", exclude_unset=True)
    known = await store.read(partial(studies.known_step, study_id=id, kind=kind, request=sent, key=key))
    if known is None:
        work = _located(kind, _result(asked, request.state.id, engine, settings.max_deadline))
        step = _step(kind, sent, await unless_disconnected(request, work))
        number, again = await store.write(partial(studies.add, study_id=id, step=step, key=key, client=client))
    else:
        number, again = known, True
    set_location(request, response, f"/studies/{id}/iterations/{number}", again)
    return detail(await store.read(partial(studies.entry, study_id=id, number=number)))


async def _located(kind: str, work: Coroutine[Any, Any, TaskResult]) -> TaskResult:
    """What `work` returns. Raises what it raises; errors about a field with its path in this request."""
    try:
        return await work
    except InvalidRequest as error:
        moved = [{**each, "loc": [each["loc"][0], kind, *each["loc"][1:]]} for each in error.errors]
        raise InvalidRequest(moved) from None
    except InvalidProblem as error:
        if isinstance(error, InvalidTable | OutsideLimits):
            raise  # about the motion
        raise InvalidProblem(f"{kind}.{error.field}", str(error)) from None


async def _result(
    asked: OptimizeRequest | EvaluateRequest, request_id: str, engine: ArmEngine, max_deadline: float
) -> TaskResult:
    """The answer of the endpoint that the request is for."""
    if isinstance(asked, OptimizeRequest):
        # all candidates: suggestions start from those that were ruled out, too
        asked = asked.model_copy(update={"candidates": "all"})
        return await engine.run(OptimizeTask(asked, request_id), deadline_of(asked, max_deadline))
    with upload() as (file, path):
        file.write(asked.model_dump_json(exclude_unset=True).encode())
        return await engine.run(EvaluateTask(path, "json", {}, "json", request_id, max_deadline), max_deadline)


@router.get(
    "/{id}/iterations/{number}",
    summary="One iteration of a study",
    response_model=IterationDetail,
    responses=problem_responses(problems.Validation, problems.UnknownStudy, problems.StoreUnavailable),
)
async def show(
    id: StudyId,
    number: Annotated[int, Path(description="The iteration's number.", examples=[1], ge=1, le=MOST_ITERATIONS)],
    store: ServiceStore,
) -> IterationDetail:
    """The request, its energy, and the state of the study after this iteration."""
    return detail(await store.read(partial(studies.entry, study_id=id, number=number)))


def _step(kind: str, sent: dict[str, Any], result: TaskResult) -> studies.Step:
    answer = orjson.loads(result.document)
    energy = answer["energy"] if kind == "optimize" else answer["total"]["energy"]
    return studies.Step(
        kind,
        sent,
        result.document,
        answer["duration"],
        energy["electrical"]["total"],
        energy["mechanical"]["total"],
        result.kept_as,
    )


def _completed(body: IterationRequest, study: Study) -> tuple[str, OptimizeRequest | EvaluateRequest]:
    """The endpoint and its request with the study's robot and objective. Raises InvalidProblem if the request names
    others."""
    if isinstance(body, OptimizeStep):
        return "optimize", _about(study, "optimize", body.optimize, "robot", "figures", "objective")
    return "evaluate", _about(study, "evaluate", body.evaluate, "robot", "figures")


def _about(study: Study, kind: str, asked: R, *names: str) -> R:
    for name in names:
        if name in asked.model_fields_set and getattr(asked, name) != getattr(study, name):
            raise InvalidProblem(
                f"{kind}.{name}", f"The study has another {name}: leave {name} out, or create another study."
            )
    # null is left out: that is what a request without figures says
    same = {name: getattr(study, name) for name in names if getattr(study, name) is not None}
    return asked.model_copy(update=same)
