"""POST /replay."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.replay.task import ReplayAnswer, ReplayRequest, ReplayTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.stored import UnknownAnswer, UnknownFigures
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.evaluate.errors import NotCertified

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/replay",
    summary="A motion in an independent simulator",
    response_model=model_of(ReplayAnswer),
    responses=problem_responses(
        *WORKER_PROBLEMS,
        UnknownAnswer,
        UnknownFigures,
        NotCertified,
    ),
)
async def replay(body: ReplayRequest, tasks: ServiceTasks) -> Response:
    """Replays the motion of an answer in MuJoCo under a controller, and compares the simulation
    with the answer: tracking deviation, torques, contacts and energy. With `perturb`, it also
    replays the motion on arms with perturbed parameters, and returns the savings that remain."""
    return await tasks.answer(ReplayTask(body, tasks.request_id), body)
