"""Responses: results of tasks, and exceptions as problems."""

from __future__ import annotations

import asyncio

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.exceptions import (
    InvalidRequest,
    MethodNotAllowed,
    NoKey,
    NotFound,
    ServiceError,
    UnsupportedMediaType,
)
from joulepath.app.http.authentication import challenge
from joulepath.app.http.problem_details import invalid_request, problem_content, problem_type
from joulepath.optimizer.exceptions import JoulepathError

CACHE_HEADER = "Joulepath-Cache"
PROBLEM_MEDIA_TYPE = "application/problem+json"


def install_handlers(app: FastAPI) -> None:
    """Answers every exception of the routes with a problem. `RequestContext` handles those that no route expects."""
    for kind in (JoulepathError, ServiceError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, problem_response)


async def problem_response(request: Request, error: Exception) -> Response:
    """The response to a request that failed with `error`: a problem (RFC 9457)."""
    headers: dict[str, str] = {}
    if isinstance(error, RequestValidationError):
        error = UnsupportedMediaType() if _is_not_json(request, error) else invalid_request(error)
    elif isinstance(error, HTTPException):
        headers |= error.headers or {}
        if error.status_code == 405:
            headers["Allow"] = ", ".join(_allowed(request))
        error = _from_framework(error)
    elif isinstance(error, NoKey):
        headers["WWW-Authenticate"] = challenge(error)
    problem = problem_type(error)
    request.state.problem = problem.slug()
    if problem.retry_after is not None:
        headers["Retry-After"] = str(problem.retry_after)
    if hasattr(
        error, "candidates"
    ):  # thousands of them: a thread encodes it, and the event loop serves others meanwhile
        body = await asyncio.to_thread(_encoded, error, request.state.id)
    else:
        body = _encoded(error, request.state.id)
    return Response(body, problem.model_fields["status"].default, headers, PROBLEM_MEDIA_TYPE)


def _encoded(error: Exception, request_id: str) -> bytes:
    return json_document(problem_content(error, request_id))


def result_response(result: TaskResult) -> Response:
    """The response with a task's result."""
    cached = {} if result.age is None else {"Age": str(result.age), CACHE_HEADER: "hit"}
    return Response(result.document, headers=cached, media_type=result.media_type)


def _is_not_json(request: Request, error: RequestValidationError) -> bool:
    """Whether the body was not read because it is declared as something else. FastAPI then validates its bytes."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    is_json = kind.startswith("application/") and kind.endswith(("/json", "+json"))
    return not is_json and kind != "" and any(each["loc"] == ("body",) for each in error.errors())


def _allowed(request: Request) -> list[str]:
    """Every method that the path accepts. Starlette's own list is that of the first route with this path only."""
    return [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)
    ]


def _from_framework(error: HTTPException) -> Exception:
    """The service's error for one of the framework."""
    if isinstance(error.__cause__, ServiceError):  # it was raised while the body was read
        return error.__cause__
    if error.status_code == 400:  # the body could not be read: not UTF-8, nested too deep, ...
        return InvalidRequest([{"loc": ["body"], "msg": "The body cannot be read as JSON"}])
    errors: dict[int, type[ServiceError]] = {404: NotFound, 405: MethodNotAllowed}
    kind = errors.get(error.status_code)
    return error if kind is None else kind()
