"""POST /optimize."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.routes.parameters import allowed_deadline
from app.schemas import errors as problems
from app.schemas.request import OptimizeRequest
from app.schemas.response import OptimizeResponse
from app.settings import Settings
from app.tasks.optimize import OptimizeTask

router = APIRouter(tags=["motion"])


@router.post(
    "/optimize",
    summary="The motion of least energy",
    response_model=OptimizeResponse,
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
async def optimize(request: Request, body: OptimizeRequest) -> Response:
    """Finds the motion of least energy from rest at `start` to rest at `goal`, over every arm configuration, and
    returns it with its energy breakdown and a certificate that it holds every limit."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    task = OptimizeTask(body, request.state.id)
    work = engine.run(task, allowed_deadline(body, settings.max_deadline))
    return to_http(await unless_disconnected(request, work))
