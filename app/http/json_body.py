"""Treats the body of `curl -d @file` as JSON. curl declares it as a form, but no route takes forms.

The same holds for plain text, which some clients declare if they are told nothing.
"""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Receive, Scope, Send

FORM = "application/x-www-form-urlencoded"
TEXT = "text/plain"
_CSV_PATHS = ("/evaluate", "/logs")


class JsonBody:
    """ASGI middleware: declares a body as JSON if it is declared as a form, as plain text, or not at all.

    `POST /evaluate` and `POST /logs` look at such a body themselves: they take CSV.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes the request on."""
        if scope["type"] == "http":
            headers = MutableHeaders(raw=list(scope["headers"]))
            declared = headers.get("content-type", "").partition(";")[0].strip().lower()
            if declared in ("", FORM, TEXT) and scope["path"] not in _CSV_PATHS:
                headers["content-type"] = "application/json"
                scope = {**scope, "headers": headers.raw}
        await self._app(scope, receive, send)
