"""POST /optimize."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer, OptimizeTask
from joulepath.app.api.shared.dependencies import ServiceCache
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import CACHED_HEADERS
from joulepath.app.api.shared.problem_lists import MOTION_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.progress import Tell
from joulepath.optimizer.search.errors import PathInfeasible

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/optimize",
    summary="The motion of least energy",
    response_model=model_of(OptimizeAnswer),
    responses={
        200: {"content": BY_EVENTS, "headers": CACHED_HEADERS},
        **problem_responses(*MOTION_PROBLEMS, PathInfeasible),
    },
)
async def optimize(body: OptimizeRequest, tasks: ServiceTasks, cache: ServiceCache) -> Response:
    """Finds the motion of least energy from standstill at `start` to standstill at `goal`, over all
    arm configurations. The answer has its energy breakdown, and a certificate that the motion is
    within all limits. `GET /answers/{id}` returns it again. The same request is answered from the
    database the next time; with `Cache-Control: no-cache` it is computed again. `Accept:
    text/event-stream` returns events while the search runs, and then the answer."""
    task = OptimizeTask(body, tasks.request_id)

    async def work(tell: Tell) -> TaskResult:
        deadline = tasks.deadline(body)
        asked = await cache.asked("optimize", body, deadline)
        known = await cache.find(asked, tasks.request_id)
        if known is not None:
            return known
        return await tasks.kept("optimize", await tasks.engine.run(task, deadline, tell), asked)

    return await tasks.respond(work)
