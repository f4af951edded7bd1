"""POST /ik."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.ik.task import IKAnswer, IKRequest, IKTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import POSE_PROBLEMS, WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.http.openapi import problem_responses

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
async def solve(body: IKRequest, wanted: WantedFormat, tasks: ServiceTasks) -> Response:
    """All solutions within the joint ranges, with branch, distance to the limits and smallest
    singular value. A pose with infinitely many configurations (stretched wrist) has some of them,
    with the `free` joints. Every solution has its nearest or colliding pair of bodies: links, tool,
    payload and obstacles. `Accept: text/csv` returns the joint positions as a table for
    `/evaluate`."""
    return await tasks.answer(IKTask(body, tasks.request_id, wanted), body)
