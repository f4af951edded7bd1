"""POST /optimize."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.http.disconnect import unless_disconnected
from app.http.handlers import result_response
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceArmEngine, ServiceClient, ServiceSettings, ServiceStore
from app.routes.large_bodies import LargeBodyRoute
from app.routes.later import ACCEPTED, ServiceLater
from app.routes.parameters import deadline_of
from app.routes.problem_lists import MOTION_PROBLEMS
from app.schemas import errors as problems
from app.schemas.request import OptimizeRequest
from app.schemas.response import OptimizeResponse
from app.store.store_answers import keep_answer
from app.tasks.optimize import OptimizeTask

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/optimize",
    summary="The motion of least energy",
    response_model=OptimizeResponse,
    responses={**ACCEPTED, **problem_responses(*MOTION_PROBLEMS, problems.PathInfeasible, problems.KeyReused)},
)
async def optimize(
    request: Request,
    body: OptimizeRequest,
    settings: ServiceSettings,
    engine: ServiceArmEngine,
    store: ServiceStore,
    client: ServiceClient,
    later: ServiceLater,
) -> Response:
    """Finds the motion of least energy from standstill at `start` to standstill at `goal`, over all arm configurations.
    The answer has its energy breakdown, and a certificate that the motion is within all limits. `GET /answers/{id}`
    returns it again."""
    if later.wanted:
        return await later.respond("optimize", body)
    work = engine.run(OptimizeTask(body, request.state.id), deadline_of(body, settings.max_deadline))
    result = await unless_disconnected(request, work)
    return result_response(await keep_answer(store, settings, "optimize", result, client.owner))
