"""POST /pareto."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from app.http.disconnect import unless_disconnected
from app.http.handlers import result_response
from app.http.openapi import problem_responses
from app.routes.dependencies import ServiceArmEngine, ServiceClient, ServiceSettings, ServiceStore
from app.routes.large_bodies import LargeBodyRoute
from app.routes.later import ACCEPTED, ServiceLater
from app.routes.parameters import WantedFormat, deadline_of
from app.routes.problem_lists import MOTION_PROBLEMS
from app.schemas import errors as problems
from app.schemas.pareto import ParetoRequest, ParetoResponse
from app.store.store_answers import store_answers
from app.tasks.pareto import ParetoTask

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/pareto",
    summary="Energy over duration",
    response_model=ParetoResponse,
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}}},
        **ACCEPTED,
        **problem_responses(*MOTION_PROBLEMS, problems.StoreUnavailable, problems.KeyReused),
    },
)
async def pareto(
    request: Request,
    body: ParetoRequest,
    wanted: WantedFormat,
    settings: ServiceSettings,
    engine: ServiceArmEngine,
    store: ServiceStore,
    client: ServiceClient,
    later: ServiceLater,
) -> Response:
    """Finds the Pareto front of duration and energy over all arm configurations, from the fastest motion to the motion
    of least energy. Each point refers to its complete answer. `Accept: text/csv` returns the points as CSV."""
    if later.wanted:
        return await later.respond("pareto", body)
    task = ParetoTask(body, request.state.id, wanted)
    result = await unless_disconnected(request, engine.run(task, deadline_of(body, settings.max_deadline)))
    return result_response(await store_answers(store, settings, "optimize", result, client.owner))
