"""POST /compare."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.routes.parameters import allowed_deadline
from app.schemas import errors as problems
from app.schemas.compare import CompareRequest, CompareResponse
from app.settings import Settings
from app.tasks.compare import CompareTask

router = APIRouter(tags=["motion"])


@router.post(
    "/compare",
    summary="The same motion by several methods",
    response_model=CompareResponse,
    responses=problem_responses(
        problems.Validation,
        problems.UnreachablePose,
        problems.SingularPose,
        problems.UnreachableTargets,
        problems.OutsideLimits,
        problems.StartInCollision,
        problems.GoalInCollision,
        problems.DurationTooShort,
        problems.TorqueInfeasible,
        problems.NoTrajectory,
        problems.NoCollisionFreeTrajectory,
        problems.UnknownRobot,
        problems.BodyTooLarge,
        problems.Busy,
        problems.ShuttingDown,
        problems.DeadlineExceeded,
    ),
)
async def compare(request: Request, body: CompareRequest) -> Response:
    """Solves one request by several methods, one after another, and answers a table of their energies, durations and
    solve times, each motion certified. A method that finds nothing has its problem in its row; where none finds a
    motion, the answer is the problem of the first one asked for."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    work = engine.run(CompareTask(body, request.state.id), allowed_deadline(body, settings.max_deadline))
    return to_http(await unless_disconnected(request, work))
