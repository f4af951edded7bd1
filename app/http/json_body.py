"""Treats the body of `curl -d @file` as JSON. curl declares it as a form, but no route takes forms."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Receive, Scope, Send

FORM = "application/x-www-form-urlencoded"


class JsonBody:
    """ASGI middleware: declares a body as JSON if it is declared as a form or not at all."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on."""
        if scope["type"] == "http":
            headers = MutableHeaders(raw=list(scope["headers"]))
            if headers.get("content-type", FORM).partition(";")[0].strip().lower() == FORM:
                headers["content-type"] = "application/json"
                scope = {**scope, "headers": headers.raw}
        await self._app(scope, receive, send)
