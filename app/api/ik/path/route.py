"""POST /ik/path."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.ik.path.task import IKPathAnswer, IKPathRequest, IKPathTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.exceptions import OutsideLimits

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/ik/path",
    summary="Configurations along a path of the TCP",
    response_model=model_of(IKPathAnswer),
    responses=problem_responses(*WORKER_PROBLEMS, OutsideLimits),
)
async def follow(body: IKPathRequest, tasks: ServiceTasks) -> Response:
    """Follows positions or poses of the TCP from a guess, by Levenberg-Marquardt from the previous
    configuration. Points out of reach, nearly singular or beyond a joint range are listed, but
    omitted in `trajectory`, which has the form of a request of `POST /evaluate`.
    """
    return await tasks.answer(IKPathTask(body, tasks.request_id), body)
