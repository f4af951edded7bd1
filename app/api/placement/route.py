"""POST /placement."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementAnswer, PlacementTask
from joulepath.app.api.shared.dependencies import (
    ServiceArmEngine,
    ServiceClient,
    ServiceSettings,
    ServiceStore,
)
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.later import ACCEPTED, ServiceLater
from joulepath.app.api.shared.parameters import deadline_of
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceReply
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.stored import KeyReused, UnknownFigures
from joulepath.app.http.openapi import problem_responses
from joulepath.app.store.store_answers import keep_answer, store_answers
from joulepath.optimizer.exceptions import ContradictoryOrder, OutsideLimits
from joulepath.optimizer.placement.errors import NoPlacement
from joulepath.optimizer.progress import Tell

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/placement",
    summary="Where to put the robot",
    response_model=model_of(PlacementAnswer),
    responses={
        200: {"content": BY_EVENTS},
        **ACCEPTED,
        **problem_responses(
            *WORKER_PROBLEMS,
            UnknownFigures,
            OutsideLimits,
            ContradictoryOrder,
            NoPlacement,
            KeyReused,
        ),
    },
)
async def placement(
    request: Request,
    body: PlacementRequest,
    settings: ServiceSettings,
    engine: ServiceArmEngine,
    store: ServiceStore,
    client: ServiceClient,
    later: ServiceLater,
    reply: ServiceReply,
) -> Response:
    """Finds the place of the robot, or of stops and obstacles around it, at which cycles need the
    least energy. The answer has the best and the nominal place with their complete cycles, and a
    map of the region with the energy at each place, or the reason why there is none.
    `Accept: text/event-stream` returns events while the search runs, and then the answer."""
    if later.wanted:
        return await later.respond("placement", body)
    task = PlacementTask(body, request.state.id)

    async def work(tell: Tell) -> TaskResult:
        result = await engine.run(task, deadline_of(body, settings.max_deadline), tell)
        result = await store_answers(store, settings, "optimize", result, client.owner)
        return await keep_answer(store, settings, "placement", result, client.owner)

    return await reply.of(work)
