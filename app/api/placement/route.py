"""POST /placement."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementAnswer, PlacementTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.exceptions.stored import UnknownFigures
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.exceptions import ContradictoryOrder, OutsideLimits
from joulepath.optimizer.placement.errors import NoPlacement

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/placement",
    summary="Where to put the robot",
    response_model=model_of(PlacementAnswer),
    responses={
        200: {"content": BY_EVENTS},
        **problem_responses(
            *WORKER_PROBLEMS,
            UnknownFigures,
            OutsideLimits,
            ContradictoryOrder,
            NoPlacement,
        ),
    },
)
async def placement(body: PlacementRequest, tasks: ServiceTasks) -> Response:
    """Finds the place of the robot, or of stops and obstacles around it, with the least energy of
    given cycles. The answer has the best and the nominal place with their complete cycles, and a
    map of the region with the energy of every place, or the reason why the cycles fail there.
    `Accept: text/event-stream` returns events while the search runs, and then the answer."""
    return await tasks.search("placement", PlacementTask(body, tasks.request_id), body)
