"""POST /cycle."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleAnswer, CycleTask
from joulepath.app.api.shared.dependencies import ServiceCache
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import CYCLE_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.openapi import problem_responses
from joulepath.app.tasks.read_body import HeldBody
from joulepath.app.tasks.request_key import cell_of
from joulepath.optimizer.progress import Tell

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/cycle",
    summary="A cycle of stops with least energy",
    response_model=model_of(CycleAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}}, **BY_EVENTS}},
        **problem_responses(*CYCLE_PROBLEMS),
    },
)
async def cycle(
    body: CycleRequest,
    wanted: WantedFormat,
    tasks: ServiceTasks,
    cache: ServiceCache,
) -> Response:
    """Finds the arm configurations at all stops of a cycle, and the motions between them, with the
    least total energy. The configuration at a stop affects the cost of the moves on both sides, so
    that all are chosen together. A move refers to its complete answer. `Accept:
    text/csv` returns the samples of the cycle, `Accept: text/event-stream` events while the search
    runs, and then the answer."""
    # a body above 64 KiB is not looked into here
    cell = None if isinstance(body, HeldBody) else cell_of(body)

    async def work(tell: Tell) -> TaskResult:
        task = CycleTask(body, tasks.request_id, wanted, await cache.motions(cell))
        result = await tasks.engine.run(task, tasks.deadline(body), tell)
        return await tasks.kept("cycle", result, cell=cell)

    return await tasks.respond(work)
