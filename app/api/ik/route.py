"""POST /ik and POST /ik/path."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.ik.path.task import IKPathAnswer, IKPathRequest, IKPathTask
from joulepath.app.api.ik.task import IKAnswer, IKRequest, IKTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import POSE_PROBLEMS, WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.exceptions import OutsideLimits

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)
_CSV = "q1,q2,q3,q4,q5,q6\n0.0,-1.57,1.57,-1.57,-1.57,0.0\n"


@router.post(
    "/ik",
    summary="Every arm configuration that reaches a pose",
    response_model=model_of(IKAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": _CSV}}},
        **problem_responses(*WORKER_PROBLEMS, *POSE_PROBLEMS),
    },
)
async def solve_ik(body: IKRequest, wanted: WantedFormat, tasks: ServiceTasks) -> Response:
    """All solutions within the joint ranges, with branch, distance to the limits and smallest
    singular value. A pose with infinitely many configurations (stretched wrist) has some of them,
    with the `free` joints. Every solution has its nearest or colliding pair of bodies: links, tool,
    payload and obstacles. `Accept: text/csv` returns the joint positions as a table for
    `/evaluate`."""
    return await tasks.answer(IKTask(body, tasks.request_id, wanted), body)


@router.post(
    "/ik/path",
    summary="Configurations along a path of the TCP",
    response_model=model_of(IKPathAnswer),
    responses=problem_responses(*WORKER_PROBLEMS, OutsideLimits),
)
async def follow_ik_path(body: IKPathRequest, tasks: ServiceTasks) -> Response:
    """Follows positions or poses of the TCP from a guess, by Levenberg-Marquardt from the previous
    configuration. Points out of reach, nearly singular or beyond a joint range are listed, but
    omitted in `trajectory`, which has the form of a request of `POST /evaluate`.
    """
    return await tasks.answer(IKPathTask(body, tasks.request_id), body)
