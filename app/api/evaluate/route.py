"""POST /evaluate."""

from __future__ import annotations

from typing import IO, Any, Literal

from fastapi import APIRouter, Request, Response

from joulepath.app.answers.declared import model_of
from joulepath.app.api.evaluate.task import EvaluateAnswer, EvaluateTask
from joulepath.app.api.shared.parameters import WantedFormat
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.query_settings import query_parameters
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.api.shared.uploads import received
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import UnknownFigures, UnknownLog
from joulepath.app.exceptions.transport import UnsupportedMediaType, UploadNotStored
from joulepath.app.http.json_route import UNDECLARED, media_type
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.errors import LogTooLarge

router = APIRouter(tags=["motion"])

_Kind = Literal["json", "csv"]
_KINDS: dict[str, _Kind] = {"application/json": "json", "text/csv": "csv"}
_BEGINNING = 4096
_TABLE = (
    "segment,start,end,electrical.total,…,balance_error\n1,0.0,1.5,53.1,…,9e-16\n"
    "2,1.5,3.0,99.8,…,7e-16\ntotal,0.0,3.0,152.9,…,9e-16\n"
)
"""The start of an answer as CSV."""
_REF = "#/components/schemas/{model}"


def _openapi() -> dict[str, Any]:
    """The bodies, and the settings of a CSV, unknown to FastAPI as the body goes to a file."""
    return {
        "parameters": query_parameters(EvaluateCsvSettings, "With a CSV body only. "),
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {
                    "schema": {"$ref": _REF.format(model=EvaluateRequest.__name__)}
                },
                "text/csv": {"schema": {"type": "string"}},
            },
        },
    }


def _kind_of(file: IO[bytes]) -> _Kind:
    """Kind of a body without a declared type: a JSON object, or else CSV."""
    file.seek(0)
    begins = file.read(_BEGINNING).removeprefix(b"\xef\xbb\xbf").lstrip()
    return "json" if not begins or begins.startswith((b"{", b"[")) else "csv"


@router.post(
    "/evaluate",
    summary="The energy of a given motion",
    response_model=model_of(EvaluateAnswer),
    responses={
        200: {"content": {"text/csv": {"schema": {"type": "string"}, "example": _TABLE}}},
        **problem_responses(
            *WORKER_PROBLEMS,
            UnknownFigures,
            UnknownLog,
            InvalidTable,
            LogTooLarge,
            UnsupportedMediaType,
            UploadNotStored,
        ),
    },
    openapi_extra=_openapi(),
)
async def evaluate(
    request: Request,
    wanted: WantedFormat,
    tasks: ServiceTasks,
) -> Response:
    """The energy of a given motion, per segment and in total, and its violated limits. The motion
    is a list of configurations with times, a trajectory, or a log of the arm, with measured
    energies beside the model's. It is sent as JSON, or as CSV with the settings as query
    parameters: any file of `POST /logs`. `Accept: text/csv` returns the table of energies as CSV.
    """
    declared = media_type(request.headers)
    kind = _KINDS.get(declared)
    if kind is None and declared not in UNDECLARED:
        raise UnsupportedMediaType
    async with received(request) as (file, path):
        kind = kind or _kind_of(file)
        if kind == "json" and request.query_params:
            raise InvalidRequest([{"loc": ["query"], "msg": "Put the settings into the JSON body"}])
        query, deadline = dict(request.query_params), tasks.deadline()
        task = EvaluateTask(path, kind, query, wanted, tasks.request_id, deadline)
        return await tasks.answer(task)
