"""POST /logs, GET /logs, GET, PATCH and DELETE /logs/{id}."""

from __future__ import annotations

import gzip
from functools import partial
from typing import IO, Annotated, Any

import orjson
from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from joulepath.app.api.logs.models import LogDetail, LogList, LogPage, LogSummary
from joulepath.app.api.logs.request import LogSettings
from joulepath.app.api.logs.task import ReadLogTask
from joulepath.app.api.shared.dependencies import ServiceClient, ServiceStore
from joulepath.app.api.shared.parameters import LOCATION_HEADER, set_location
from joulepath.app.api.shared.problem_lists import WORKER_PROBLEMS
from joulepath.app.api.shared.query_settings import query_parameters, settings_of
from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.api.shared.uploads import received
from joulepath.app.exceptions.access import NotOwner
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import StoreUnavailable, TooManyLogs, UnknownLog
from joulepath.app.exceptions.transport import UnsupportedMediaType, UploadNotStored
from joulepath.app.http.json_route import UNDECLARED, JsonRoute, media_type
from joulepath.app.http.openapi import problem_responses
from joulepath.app.schemas.examples.values import LOG_ID
from joulepath.app.schemas.queries import NewName
from joulepath.app.store import logs
from joulepath.app.store.tables import StoredLog, new_id, now
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.errors import EffortNotUsable, LogTooLarge

router = APIRouter(prefix="/logs", tags=["logs"], route_class=JsonRoute)

LogId = Annotated[str, Path(description="The log's id.", examples=[LOG_ID])]
_TAKEN = (
    "text/csv",
    "application/octet-stream",
    "application/gzip",
    "application/x-gzip",
    *UNDECLARED,
)
_GZIP = b"\x1f\x8b"
_SHOWN = tuple(name for name in LogSummary.model_fields if name not in ("tags", "rows", "duration"))


@router.post(
    "",
    summary="Add a log",
    status_code=201,
    response_model=LogDetail,
    responses={
        201: {"headers": LOCATION_HEADER},
        **problem_responses(
            *WORKER_PROBLEMS,
            InvalidTable,
            EffortNotUsable,
            LogTooLarge,
            TooManyLogs,
            UnsupportedMediaType,
            UploadNotStored,
        ),
    },
    openapi_extra={
        "parameters": query_parameters(LogSettings),
        "requestBody": {"required": True, "content": {"text/csv": {"schema": {"type": "string"}}}},
    },
)
async def add_log(
    request: Request,
    response: Response,
    tasks: ServiceTasks,
) -> LogDetail:
    """Adds a log of one arm for the identification of its friction, rotors and powers: a CSV file,
    plain or compressed with gzip, or a bag of ROS 2. The columns of a CSV file follow
    RTDE, ROS `JointState`, this service, or the names in `columns`."""
    declared = media_type(request.headers)
    if declared not in _TAKEN:
        raise UnsupportedMediaType
    asked = settings_of(LogSettings, request)
    async with received(request) as (file, path):
        task = ReadLogTask(path, asked, tasks.settings.max_upload_bytes, tasks.request_id)
        result = await tasks.result(task)
        body = await run_in_threadpool(_packed, file)
    log = StoredLog(
        id=new_id(),
        name=asked.name,
        robot=asked.robot,
        created=now(),
        owner=tasks.client.owner,
        settings=asked.model_dump(mode="json"),
        report=orjson.loads(result.document),
        size=len(body),
        body=body,
    )
    detail = _detail(log)
    await tasks.store.write(partial(logs.add, log=log, most=tasks.settings.logs_max_bytes))
    set_location(request, response, f"/logs/{detail.id}")
    return detail


@router.get(
    "",
    summary="List logs",
    response_model=LogList,
    responses=problem_responses(InvalidRequest, StoreUnavailable),
)
async def list_logs(page: Annotated[LogPage, Query()], store: ServiceStore) -> LogList:
    """All logs, or the logs found by `search`, newest first and page by page."""
    read = partial(logs.page, limit=page.limit, after=page.after, search=page.search)
    found, following = await store.read(read)
    shown = [_detail(log).model_dump(include=set(LogSummary.model_fields)) for log in found]
    return LogList(logs=[LogSummary(**each) for each in shown], next=following)


@router.get(
    "/{id}",
    summary="A log",
    response_model=LogDetail,
    responses=problem_responses(UnknownLog, StoreUnavailable),
)
async def show_log(id: LogId, store: ServiceStore) -> LogDetail:
    """A log without its samples: channels, moves, efforts, and warnings."""
    return _detail(await store.read(partial(logs.about, log_id=id)))


@router.patch(
    "/{id}",
    summary="Name a log",
    response_model=LogDetail,
    responses=problem_responses(InvalidRequest, UnknownLog, NotOwner, StoreUnavailable),
)
async def rename_log(
    id: LogId, body: NewName, store: ServiceStore, client: ServiceClient
) -> LogDetail:
    """Gives the log another name, or none."""
    rename = partial(logs.rename, log_id=id, name=body.name, client=client)
    return await store.write(lambda session: _detail(rename(session)))


@router.delete(
    "/{id}",
    summary="Delete a log",
    status_code=204,
    responses=problem_responses(UnknownLog, NotOwner, StoreUnavailable),
)
async def delete_log(id: LogId, store: ServiceStore, client: ServiceClient) -> None:
    """Deletes a log. Identifications from it stay."""
    await store.write(partial(logs.delete, log_id=id, client=client), frees=True)


def _detail(log: StoredLog) -> LogDetail:
    own: dict[str, Any] = {name: getattr(log, name) for name in _SHOWN}
    return LogDetail(**own, tags=log.settings["tags"], **log.report)


def _packed(file: IO[bytes]) -> bytes:
    """The received file, compressed with gzip."""
    file.seek(0)
    body = file.read()
    # the fastest level: a client waits
    return body if body.startswith(_GZIP) else gzip.compress(body, compresslevel=1)
