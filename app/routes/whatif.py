"""POST /whatif."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.routes.parameters import allowed_deadline
from app.schemas import errors as problems
from app.schemas.whatif import WhatifRequest, WhatifResponse
from app.settings import Settings
from app.store.keep import keep
from app.tasks.whatif import WhatifTask

router = APIRouter(tags=["motion"])


@router.post(
    "/whatif",
    summary="What a motion would cost on a changed arm",
    response_model=WhatifResponse,
    responses=problem_responses(
        problems.Validation,
        problems.InvalidTable,
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
)
async def whatif(request: Request, body: WhatifRequest) -> Response:
    """Asks one motion of an arm as it is and of changed ones: lighter links, another payload, other drives or limits.
    Each change is answered twice, as a difference from the base, part by part: for the base's own motion on the changed
    arm, and for the best motion of the changed arm. A given motion (`evaluate`) is evaluated only."""
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    task = WhatifTask(body, request.state.id)
    reply = await unless_disconnected(request, engine.run(task, allowed_deadline(body, settings.max_deadline)))
    kind = "evaluate" if body.optimize is None else "optimize"
    return to_http(await keep(request.app.state.store, settings, kind, reply))
