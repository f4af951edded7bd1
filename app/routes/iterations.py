"""POST /studies/{id}/iterations and GET /studies/{id}/iterations/{number}."""

from __future__ import annotations

from functools import partial
from tempfile import NamedTemporaryFile
from typing import Annotated, Any, TypeVar

import orjson
from fastapi import APIRouter, Body, Path, Request, Response

from app.engine.pool import Engine
from app.engine.reply import Reply
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.routes.parameters import CREATED_HEADERS, Key, StudyId, allowed_deadline, set_location
from app.schemas import errors as problems
from app.schemas.evaluate import EvaluateRequest
from app.schemas.request import OptimizeRequest
from app.schemas.studies import IterationDetail, IterationRequest, OptimizeStep
from app.settings import Settings
from app.store import studies
from app.store.store import Store
from app.store.tables import Study
from app.studies.answers import detail
from app.tasks.evaluate import EvaluateTask
from app.tasks.optimize import OptimizeTask
from optimizer.exceptions import InvalidProblem

R = TypeVar("R", OptimizeRequest, EvaluateRequest)

router = APIRouter(prefix="/studies", tags=["studies"])

MOST_ITERATIONS = 2**31 - 1
"""The largest number that the database counts to."""


@router.post(
    "/{id}/iterations",
    summary="Add an iteration",
    status_code=201,
    response_model=IterationDetail,
    responses={
        201: {"headers": CREATED_HEADERS},
        **problem_responses(
            problems.Validation,
            problems.KeyReused,
            problems.UnreachablePose,
            problems.SingularPose,
            problems.OutsideLimits,
            problems.StartInCollision,
            problems.GoalInCollision,
            problems.DurationTooShort,
            problems.TorqueInfeasible,
            problems.NoTrajectory,
            problems.NoCollisionFreeTrajectory,
            problems.UnknownRobot,
            problems.UnknownStudy,
            problems.BodyTooLarge,
            problems.Busy,
            problems.ShuttingDown,
            problems.StoreUnavailable,
            problems.DeadlineExceeded,
        ),
    },
)
async def add(
    request: Request,
    response: Response,
    id: StudyId,
    body: Annotated[IterationRequest, Body()],
    key: Key = None,
) -> Any:
    """Computes the next step and keeps it: what was asked, the whole answer, and its energy against the step before,
    the best and the threshold. A request that fails is answered with its problem and leaves no trace in the study."""
    store: Store = request.app.state.store
    study = (await store.read(partial(studies.history, study_id=id))).study
    kind, asked = _completed(body, study)
    sent = asked.model_dump(mode="json", exclude_unset=True)
    known = await store.read(partial(studies.known_step, study_id=id, kind=kind, request=sent, key=key))
    if known is None:
        reply = await unless_disconnected(request, _answer(request, asked))
        if reply.status != 200:
            return to_http(reply)
        number, again = await store.write(
            partial(studies.add, study_id=id, step=_step(kind, sent, reply.body), key=key)
        )
    else:
        number, again = known, True
    set_location(request, response, f"{id}/iterations/{number}", again)
    return detail(await store.read(partial(studies.up_to, study_id=id, number=number)))


async def _answer(request: Request, asked: OptimizeRequest | EvaluateRequest) -> Reply:
    """What the endpoint of that request answers."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    if isinstance(asked, OptimizeRequest):
        deadline = allowed_deadline(asked, settings.max_deadline)
        return await engine.run(OptimizeTask(asked, request.state.id), deadline)
    with NamedTemporaryFile(prefix="joulepath-", suffix=".json") as file:
        file.write(asked.model_dump_json(exclude_unset=True).encode())
        file.flush()
        task = EvaluateTask(file.name, "json", {}, "json", request.state.id)
        return await engine.run(task, settings.max_deadline)


@router.get(
    "/{id}/iterations/{number}",
    summary="One iteration of a study",
    response_model=IterationDetail,
    responses=problem_responses(problems.Validation, problems.UnknownStudy, problems.StoreUnavailable),
)
async def show(
    request: Request,
    id: StudyId,
    number: Annotated[int, Path(description="The iteration's number.", examples=[1], ge=1, le=MOST_ITERATIONS)],
) -> IterationDetail:
    """What was asked, what it came to, and where the study then stood."""
    store: Store = request.app.state.store
    return detail(await store.read(partial(studies.up_to, study_id=id, number=number)))


def _step(kind: str, sent: dict[str, Any], body: bytes) -> studies.Step:
    answer = orjson.loads(body)
    energy = answer["energy"] if kind == "optimize" else answer["total"]["energy"]
    return studies.Step(
        kind, sent, body, answer["duration"], energy["electrical"]["total"], energy["mechanical"]["total"]
    )


def _completed(body: IterationRequest, study: Study) -> tuple[str, OptimizeRequest | EvaluateRequest]:
    """The endpoint and its request, about the study's robot and objective. Raises InvalidProblem where it is about
    another."""
    if isinstance(body, OptimizeStep):
        return "optimize", _about(study, "optimize", body.optimize, "robot", "objective")
    return "evaluate", _about(study, "evaluate", body.evaluate, "robot")


def _about(study: Study, kind: str, asked: R, *names: str) -> R:
    for name in names:
        if name in asked.model_fields_set and getattr(asked, name) != getattr(study, name):
            raise InvalidProblem(
                f"{kind}.{name}", f"The study is about another {name}: leave {name} out, or begin another study."
            )
    return asked.model_copy(update={name: getattr(study, name) for name in names})
