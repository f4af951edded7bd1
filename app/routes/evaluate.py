"""POST /evaluate."""

from __future__ import annotations

from tempfile import NamedTemporaryFile
from typing import Any, Literal

from fastapi import APIRouter, Request, Response

from app.engine.pool import Engine
from app.exceptions import UnsupportedMediaType
from app.http.disconnect import unless_disconnected
from app.http.handlers import to_http
from app.http.openapi import problem_responses
from app.schemas import errors as problems
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateResponse
from app.schemas.examples.evaluate import CSV_TABLE
from app.settings import Settings
from app.tasks.evaluate import EvaluateTask

router = APIRouter(tags=["motion"])

_KINDS: dict[str, Literal["json", "csv"]] = {"application/json": "json", "text/csv": "csv"}
_REF = "#/components/schemas/{model}"


def _openapi() -> dict[str, Any]:
    """What FastAPI cannot know, since the body goes to a file unread: the bodies and a CSV's settings."""
    schema = EvaluateCsvSettings.model_json_schema(ref_template=_REF)
    parameters = [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": f"With a CSV body only, as JSON or a bare word. {content['description']}",
            "content": {"application/json": {"schema": content}},
        }
        for name, content in schema["properties"].items()
    ]
    return {
        "parameters": parameters,
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": {"$ref": _REF.format(model=EvaluateRequest.__name__)}},
                "text/csv": {"schema": {"type": "string"}},
            },
        },
    }


@router.post(
    "/evaluate",
    summary="The energy of a given motion",
    response_model=EvaluateResponse,
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": CSV_TABLE}}},
        **problem_responses(
            problems.Validation,
            problems.InvalidTable,
            problems.UnknownRobot,
            problems.BodyTooLarge,
            problems.UnsupportedMediaType,
            problems.Busy,
            problems.ShuttingDown,
            problems.DeadlineExceeded,
        ),
    },
    openapi_extra=_openapi(),
)
async def evaluate(request: Request) -> Response:
    """What a given motion costs, segment by segment and in total, and which limits it holds or breaks, and where. The
    motion is a list of configurations with times between them, or a log; as JSON, or as CSV with the settings as query
    parameters. `Accept: text/csv` gives the table of energies as CSV."""
    kind = _KINDS.get(request.headers.get("content-type", "").partition(";")[0].strip().lower())
    if kind is None:
        raise UnsupportedMediaType
    wanted: Literal["json", "csv"] = "csv" if "text/csv" in request.headers.get("accept", "").lower() else "json"
    settings: Settings = request.app.state.settings
    engine: Engine = request.app.state.engine
    with NamedTemporaryFile(prefix="joulepath-", suffix=f".{kind}") as file:
        async for chunk in request.stream():
            file.write(chunk)
        file.flush()
        task = EvaluateTask(file.name, kind, dict(request.query_params), wanted, request.state.id)
        return to_http(await unless_disconnected(request, engine.run(task, settings.max_deadline)))
