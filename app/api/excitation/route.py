"""POST /excitation."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.excitation.task import ExcitationAnswer, ExcitationRequest, ExcitationTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.stored import UnknownFigures
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.exceptions import OutsideLimits
from joulepath.optimizer.excitation.errors import ExcitationInfeasible

router = APIRouter(tags=["logs"], route_class=LargeBodyRoute)
_CSV = "t,q1,…,q6,v1,…,v6,a1,…,a6\n0.0,0.0,-1.57,…\n0.008,0.0001,-1.5699,…\n"


@router.post(
    "/excitation",
    summary="A motion that excites an arm's parameters",
    response_model=model_of(ExcitationAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": _CSV}}},
        **problem_responses(*WORKER_PROBLEMS, UnknownFigures, OutsideLimits, ExcitationInfeasible),
    },
)
async def excitation(
    body: ExcitationRequest, wanted: WantedFormat, tasks: ServiceTasks
) -> Response:
    """A periodic motion from rest to rest for a log with separable friction, rotor inertias and
    base parameters, within all limits and free of collisions. `Accept: text/csv` returns its
    samples as a table for `/evaluate`."""
    return await tasks.answer(ExcitationTask(body, tasks.request_id, wanted), body)
