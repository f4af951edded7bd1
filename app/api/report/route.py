"""POST /report."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from joulepath.app.api.report.request import ReportRequest
from joulepath.app.api.report.task import ReportTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import CYCLE_PROBLEMS, MOTION_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.report import NoTypst
from joulepath.app.exceptions.stored import UnknownAnswer
from joulepath.app.http.openapi import problem_responses
from joulepath.optimizer.evaluate.errors import NotCertified
from joulepath.optimizer.placement.errors import NoPlacement

router = APIRouter(tags=["results"], route_class=LargeBodyRoute)

_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The report.",
        "content": {
            "text/html": {"schema": {"type": "string"}},
            "application/pdf": {"schema": {"type": "string", "format": "binary"}},
        },
        "headers": {
            "Content-Disposition": {
                "description": "`inline`, with a name for the file.",
                "schema": {"type": "string"},
            }
        },
    }
}


@router.post(
    "/report",
    summary="One page on a motion or a cycle",
    response_class=Response,
    responses={
        **_FILE,
        **problem_responses(
            *dict.fromkeys((*MOTION_PROBLEMS, *CYCLE_PROBLEMS)),
            UnknownAnswer,
            NoPlacement,
            NotCertified,
            NoTypst,
        ),
    },
)
async def report(body: ReportRequest, tasks: ServiceTasks) -> Response:
    """Writes a page about a motion, a cycle or a placement: energy and its parts, savings against
    baselines within all limits or other places, costs per shift and year. Request and answer are
    attached, so that `joulepath check` can compute both again."""
    result = await tasks.result(ReportTask(body, tasks.request_id))
    name = f"joulepath-report.{body.format}"
    return Response(
        result.document,
        media_type=result.media_type,
        headers={"Content-Disposition": f'inline; filename="{name}"'},
    )
