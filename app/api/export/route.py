"""POST /export/{format}."""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response

from joulepath.app.api.export.request import ExportRequest
from joulepath.app.api.export.task import ExportResult, ExportTask
from joulepath.app.api.shared.large_bodies import LargeBodyRoute
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.exceptions.stored import UnknownAnswer, UnknownFigures
from joulepath.app.http.openapi import problem_responses
from joulepath.app.http.weights import JSON, is_wanted
from joulepath.optimizer.evaluate.errors import NotCertified
from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.export import FORMATS
from joulepath.optimizer.export.formats import FormatName
from joulepath.optimizer.joint_limits.errors import NoJointLimits

router = APIRouter(tags=["results"], route_class=LargeBodyRoute)

_NOT_IN_A_NAME = re.compile(r"[^A-Za-z0-9._-]")
_FORMAT = Path(
    description="The format. "
    + " ".join(f"`{name}`: {each.meaning}" for name, each in FORMATS.items()),
    examples=["urscript"],
    # in the order of the enum, as the generators of clients read it
    json_schema_extra={"x-enum-descriptions": [each.meaning for each in FORMATS.values()]},
)
_MEDIA_TYPES = (
    "text/plain",
    "application/yaml",
    "application/json",
    "text/csv",
    "application/octet-stream",
)
_HEADERS = {
    "Content-Disposition": "`attachment`, with a name for the file.",
    "Joulepath-Speed-Scale": "Fraction of the speed: `speed_scale` of the request.",
    "Joulepath-Worst-Ratio": "Largest value / limit of the exported motion, by its certificate, "
    "computed again.",
    "Joulepath-Notes": "Sentences on the file, separated by `; `: how far it deviates, and what it "
    "leaves out.",
}
_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file.",
        "content": {
            media: {"schema": {} if media == "application/json" else {"type": "string"}}
            for media in _MEDIA_TYPES
        },
        "headers": {
            name: {"description": text, "schema": {"type": "string"}}
            for name, text in _HEADERS.items()
        },
    }
}


@router.post(
    "/export/{format}",
    summary="A motion as a program or file for a controller",
    response_class=Response,
    responses={
        **_FILE,
        **problem_responses(
            *WORKER_PROBLEMS,
            UnknownFigures,
            UnknownAnswer,
            NotCertified,
            FormatUnsuitable,
            NoJointLimits,
        ),
    },
)
async def export(
    request: Request,
    format: Annotated[FormatName, _FORMAT],
    body: ExportRequest,
    tasks: ServiceTasks,
) -> Response:
    """Writes the motion of an answer as a file for a robot controller. The certificate of the
    motion is computed again for the requested speed; a motion without a valid certificate is not
    exported. No format was run on hardware."""
    as_json = is_wanted(request, JSON)
    result = await tasks.result(ExportTask(body, format, as_json, tasks.request_id))
    assert isinstance(result, ExportResult)
    return _response(result)


def _response(result: ExportResult) -> Response:
    name = _NOT_IN_A_NAME.sub("_", result.name)
    values = (
        f'attachment; filename="{name}"',
        f"{result.speed_scale:g}",
        f"{result.worst_ratio:.6f}",
        "; ".join(result.notes),
    )
    return Response(
        result.document,
        headers=dict(zip(_HEADERS, values, strict=True)),
        media_type=result.media_type,
    )
