"""Responses: results of tasks, and exceptions as problems."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.exceptions.access import Unauthenticated
from joulepath.app.exceptions.base import InvalidRequest, ServiceError
from joulepath.app.exceptions.transport import MethodNotAllowed, NotFound, UnsupportedMediaType
from joulepath.app.http.authentication import challenge
from joulepath.app.http.json_route import media_type
from joulepath.app.http.problems import invalid_request, problem_of, reported
from joulepath.optimizer.exceptions import DeclaredError

CACHE_HEADER = "Joulepath-Cache"
PROBLEM_MEDIA_TYPE = "application/problem+json"


def install_handlers(app: FastAPI) -> None:
    """Answers expected exceptions of routes by problems; `RequestContext` handles all others."""
    for kind in (DeclaredError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, problem_response)


async def problem_response(request: Request, error: Exception) -> Response:
    """The response to a failed request: a problem (RFC 9457)."""
    headers: dict[str, str] = {}
    if isinstance(error, RequestValidationError):
        error = UnsupportedMediaType() if _is_not_json(request, error) else invalid_request(error)
    elif isinstance(error, HTTPException):
        headers |= error.headers or {}
        if error.status_code == 405:
            headers["Allow"] = ", ".join(_allowed(request))
        error = _from_framework(error)
    elif isinstance(error, Unauthenticated):
        headers["WWW-Authenticate"] = challenge(error)
    told = reported(error)
    request.state.problem = told.slug()
    if told.retry_after is not None:
        headers["Retry-After"] = str(told.retry_after)
    body = json_document(problem_of(told, request.state.id))
    return Response(body, told.status, headers, PROBLEM_MEDIA_TYPE)


def result_response(result: TaskResult) -> Response:
    """The response with a task's result."""
    cached = {} if result.age is None else {"Age": str(result.age), CACHE_HEADER: "hit"}
    return Response(result.document, headers=cached, media_type=result.media_type)


def _is_not_json(request: Request, error: RequestValidationError) -> bool:
    """Whether the body was not read because it is declared as something else. FastAPI then
    validates its bytes.
    """
    kind = media_type(request.headers)
    is_json = kind.startswith("application/") and kind.endswith(("/json", "+json"))
    return not is_json and kind != "" and any(each["loc"] == ("body",) for each in error.errors())


def _allowed(request: Request) -> list[str]:
    """All methods of the path; Starlette only lists those of the first route with this path."""
    return [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(
            route.matches({**request.scope, "method": method})[0] is Match.FULL
            for route in request.app.routes
        )
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
