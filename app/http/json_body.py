"""Takes the body of `curl -d @file` for what it is: JSON.

curl declares every `-d` body a form, and no route here takes forms.
"""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Receive, Scope, Send

FORM = "application/x-www-form-urlencoded"


class JsonBody:
    """ASGI middleware: a body declared a form, or not declared at all, is declared JSON."""

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
