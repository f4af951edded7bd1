"""POST /advice."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.advice.request import AdviceRequest
from joulepath.app.api.advice.task import AdviceAnswer, AdviceTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import CYCLE_PROBLEMS, MOTION_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.stored import UnknownAnswer
from joulepath.app.http.openapi import problem_responses

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/advice",
    summary="Changes that save energy",
    response_model=model_of(AdviceAnswer),
    responses=problem_responses(*dict.fromkeys((*MOTION_PROBLEMS, *CYCLE_PROBLEMS)), UnknownAnswer),
)
async def advice(body: AdviceRequest, tasks: ServiceTasks) -> Response:
    """Computes changes of a task: a motion over the whole cycle, brakes at rest, a cycle without
    the moves from and to the start, shorter stops, a lighter tool. Every change is optimised, and
    listed with its energy if it saves energy. The service stores no answer."""
    return await tasks.answer(AdviceTask(body, tasks.request_id))
