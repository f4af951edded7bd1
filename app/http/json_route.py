"""Routes with strict JSON bodies: no duplicate names, and errors with line and column."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.datastructures import Headers, MutableHeaders

from joulepath.app.convert.json_text import parsed_json
from joulepath.app.http.weights import JSON

UNDECLARED = ("", "application/x-www-form-urlencoded", "text/plain")
"""Default media types of clients: curl's `-d @file` declares a form, some clients plain text."""


class JsonRequest(Request):
    """A request with a strict reader of JSON."""

    _parts: list[bytes] | None = None
    _whole: bytes | None = None

    async def parts(self) -> list[bytes]:
        """The received parts of the body; joining a large one would delay other requests."""
        if self._parts is None:
            self._parts = [part async for part in self.stream()]
        return self._parts

    async def body(self) -> bytes:
        """The body."""
        if self._whole is None:
            self._whole = b"".join(await self.parts())
        return self._whole

    async def json(self) -> Any:
        """The body. Raises InvalidRequest."""
        return parsed_json(await self.body())


def strictly(request: Request) -> JsonRequest:
    """The same request with a strict reader; its body must be unread.

    A body of a type in `UNDECLARED` counts as JSON, since JSON routes take neither forms nor text.
    """
    if isinstance(request, JsonRequest):
        return request
    headers = MutableHeaders(scope=request.scope)
    if media_type(headers) in UNDECLARED:
        headers["content-type"] = JSON
    return JsonRequest(request.scope, request.receive)


def media_type(headers: Headers) -> str:
    """The media type of the body as it is declared, in small letters and without parameters."""
    return headers.get("content-type", "").partition(";")[0].strip().lower()


class JsonRoute(APIRoute):
    """The class of routes with JSON bodies: `APIRouter(route_class=JsonRoute)`.

    A route without one, such as that of an upload, gets its request as it arrives.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler for a strict request."""
        handler = super().get_route_handler()
        if self.body_field is None:
            return handler

        async def strict(request: Request) -> Response:
            # Only a request with an unread body may be replaced.
            return await handler(strictly(request))

        return strict
