"""Routes whose JSON bodies are read strictly: no name twice, and errors that say line and
column."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.datastructures import Headers, MutableHeaders

from joulepath.app.convert.json_text import parsed_json
from joulepath.app.http.weights import JSON

UNDECLARED = ("", "application/x-www-form-urlencoded", "text/plain")
"""Media types of clients that were told nothing: curl's `-d @file` declares a form, some clients
plain text.
"""


class JsonRequest(Request):
    """A request that reads JSON strictly."""

    _parts: list[bytes] | None = None
    _whole: bytes | None = None

    async def parts(self) -> list[bytes]:
        """The body as it was received: to put a large one together would hold up others."""
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
    """The same request, read strictly. Its body must not have been read, unless it is one already.

    A body of one of the types `UNDECLARED` becomes JSON: no JSON route takes forms or plain text.
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
    """The class of every route that takes JSON: `APIRouter(route_class=JsonRoute)`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler, for a request that reads JSON strictly."""
        handler = super().get_route_handler()

        async def strict(request: Request) -> Response:
            # one that has read its body may not be replaced
            return await handler(strictly(request))

        return strict
