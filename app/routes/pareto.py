"""POST /pareto."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.routes.parameters import allowed_deadline
from app.schemas import errors as problems
from app.schemas.pareto import ParetoRequest, ParetoResponse
from app.settings import Settings
from app.store.keep import keep
from app.tasks.pareto import ParetoTask

router = APIRouter(tags=["motion"])


@router.post(
    "/pareto",
    summary="Energy over duration",
    response_model=ParetoResponse,
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}}},
        **problem_responses(
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
            problems.StoreUnavailable,
            problems.DeadlineExceeded,
        ),
    },
)
async def pareto(request: Request, body: ParetoRequest) -> Response:
    """Finds the motions of which none beats another in both duration and energy, from the fastest to the one of least
    energy, over every arm configuration. Each point refers to its whole answer, certificate included.
    `Accept: text/csv` gives the points as CSV."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    wanted: Literal["json", "csv"] = "csv" if "text/csv" in request.headers.get("accept", "").lower() else "json"
    task = ParetoTask(body, request.state.id, wanted)
    reply = await unless_disconnected(request, engine.run(task, allowed_deadline(body, settings.max_deadline)))
    return to_http(await keep(request.app.state.store, settings, "optimize", reply))
