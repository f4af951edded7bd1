"""POST /pareto."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.pareto.task import ParetoAnswer, ParetoRequest, ParetoTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import MOTION_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.exceptions.stored import StoreUnavailable
from joulepath.app.http.openapi import problem_responses

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/pareto",
    summary="Energy over duration",
    response_model=model_of(ParetoAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}, **BY_EVENTS}},
        **problem_responses(*MOTION_PROBLEMS, StoreUnavailable),
    },
)
async def pareto(body: ParetoRequest, wanted: WantedFormat, tasks: ServiceTasks) -> Response:
    """Finds the Pareto front of duration and energy over all arm configurations, from the fastest
    motion to the motion of least energy. Each point refers to its complete answer.
    `Accept: text/csv` returns the points as CSV, `Accept: text/event-stream` events while the
    search runs, and then the answer."""
    return await tasks.search("pareto", ParetoTask(body, tasks.request_id, wanted), body)
