"""A layer that refuses requests before their bodies are read."""

from __future__ import annotations

from collections.abc import Callable

from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from joulepath.app.exceptions import ServiceError
from joulepath.app.http.handlers import problem_response


class Gate:
    """ASGI middleware: what `check` raises is the answer to the request."""

    def __init__(self, app: ASGIApp, check: Callable[[Request], None]) -> None:
        self._app = app
        self._check = check

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on, or answers it with a problem."""
        answer: ASGIApp = self._app
        if scope["type"] == "http":
            request = Request(scope)
            try:
                self._check(request)
            except ServiceError as error:
                answer = await problem_response(request, error)
        await answer(scope, receive, send)
