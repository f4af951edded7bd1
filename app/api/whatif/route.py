"""POST /whatif."""

from __future__ import annotations

from fastapi import APIRouter, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import MOTION_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.api.whatif.answer import WhatifAnswer
from joulepath.app.api.whatif.task import WhatifRequest, WhatifTask
from joulepath.app.exceptions.stored import StoreUnavailable, UnknownLog
from joulepath.app.http.handlers import result_response
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.search.errors import PathInfeasible

router = APIRouter(tags=["motion"], route_class=LargeBodyRoute)


@router.post(
    "/whatif",
    summary="The energy of a motion on a changed arm",
    response_model=model_of(WhatifAnswer),
    responses={
        **problem_responses(
            *MOTION_PROBLEMS,
            PathInfeasible,
            InvalidTable,
            UnknownLog,
            StoreUnavailable,
        ),
    },
)
async def whatif(body: WhatifRequest, tasks: ServiceTasks) -> Response:
    """Compares one motion on the arm as it is with the same task on changed arms: lighter links,
    another payload, other drives or limits. Each change has two results, as differences from the
    base: the base's motion on the changed arm, and the best motion of the changed arm. A given
    motion (`evaluate`) is evaluated only."""
    result = await tasks.result(WhatifTask(body, tasks.request_id), body)
    parts = "evaluate" if body.optimize is None else "optimize"
    return result_response(await tasks.kept("whatif", result, parts=parts))
