"""POST /ik/path."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.ik_path import IKPathRequest, IKPathResponse
from app.settings import Settings
from app.tasks.ik_path import IKPathTask

router = APIRouter(tags=["motion"])


@router.post(
    "/ik/path",
    summary="Configurations along a path of the TCP",
    response_model=IKPathResponse,
    responses=problem_responses(
        problems.Validation,
        problems.OutsideLimits,
        problems.UnknownRobot,
        problems.BodyTooLarge,
        problems.Busy,
        problems.ShuttingDown,
        problems.DeadlineExceeded,
    ),
)
async def follow(request: Request, body: IKPathRequest) -> Response:
    """Follows positions or poses of the TCP from a guess, each from the configuration before (Levenberg-Marquardt).
    What is out of reach, nearly singular or beyond a joint's range is listed and left out of `trajectory`, which
    `POST /evaluate` takes as it is."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    work = engine.run(IKPathTask(body, request.state.id), settings.max_deadline)
    return to_http(await unless_disconnected(request, work))
