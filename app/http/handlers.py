"""The one exception handler."""

from __future__ import annotations

from collections.abc import Mapping

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from app.engine.reply import Reply
from app.exceptions import BodyTooLarge, InvalidRequest, MethodNotAllowed, NotFound, ServiceError
from app.http.problem_details import problem_reply
from optimizer.exceptions import JoulepathError


def install_handlers(app: FastAPI) -> None:
    """Answers every exception of the routes as a problem; `RequestContext` passes on what no route caught."""

    async def handle(request: Request, error: Exception) -> Response:
        if isinstance(error, RequestValidationError):
            return respond(request, InvalidRequest.by_pydantic(error.errors()))
        return respond(request, error)

    for kind in (JoulepathError, ServiceError, RequestValidationError, HTTPException):
        app.add_exception_handler(kind, handle)


def respond(request: Request, error: Exception) -> Response:
    """The answer to a request that failed."""
    headers: Mapping[str, str] = {}
    if isinstance(error, HTTPException):
        headers = error.headers or {}
        if error.status_code == 405:
            headers = {**headers, "Allow": ", ".join(_allowed(request))}
        error = _from_framework(error)
    reply = problem_reply(error, request.state.id)
    return to_http(Reply(reply.status, reply.body, {**headers, **reply.headers}))


def to_http(reply: Reply) -> Response:
    """A reply as an HTTP response."""
    return Response(reply.body, reply.status, reply.headers, reply.media_type)


def _allowed(request: Request) -> list[str]:
    """Every method that the path takes: Starlette names those of the first route that has the path alone."""
    return [
        method
        for method in ("GET", "POST", "PUT", "PATCH", "DELETE")
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in request.app.routes)
    ]


def _from_framework(error: HTTPException) -> Exception:
    """The framework's own refusals."""
    if error.status_code == 400:  # the body could not be read: not UTF-8, nested too deep, ...
        return InvalidRequest([{"loc": ["body"], "msg": "The body is no JSON that can be read"}])
    refusals: dict[int, type[ServiceError]] = {404: NotFound, 405: MethodNotAllowed, 413: BodyTooLarge}
    refusal = refusals.get(error.status_code)
    return error if refusal is None else refusal()
