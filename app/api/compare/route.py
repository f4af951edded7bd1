"""POST /compare."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.compare.task import CompareAnswer, CompareRequest, CompareTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import MOTION_PROBLEMS
from joulepath.app.api.shared.reply import BY_EVENTS, ServiceTasks
from joulepath.app.http.openapi import problem_responses

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/compare",
    summary="The same motion by several methods",
    response_model=model_of(CompareAnswer),
    responses={
        200: {"content": BY_EVENTS},
        **problem_responses(*MOTION_PROBLEMS),
    },
)
async def compare(body: CompareRequest, tasks: ServiceTasks) -> Response:
    """Solves one request with several methods, one after another. The answer is a table of their
    energies, durations and solve times, with certified motions. The row of a method without a
    motion has its problem. If no method finds a motion, the answer is the problem of the first
    method in the request. `Accept: text/event-stream` returns events while the methods run, and
    then the answer."""
    return await tasks.search("compare", CompareTask(body, tasks.request_id), body)
