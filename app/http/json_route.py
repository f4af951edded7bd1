"""Routes whose JSON bodies are read strictly: no name twice, and errors that say line and column."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from joulepath.app.convert.json_text import parsed_json
from joulepath.app.exceptions import InvalidRequest
from joulepath.app.http.refused_body import RefusedBody


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
        """The body. Raises RefusedBody."""
        try:
            return parsed_json(await self.body())
        except InvalidRequest as error:
            raise RefusedBody(error) from None


def strictly(request: Request) -> JsonRequest:
    """The same request, read strictly. Its body must not have been read, unless it is one already."""
    return request if isinstance(request, JsonRequest) else JsonRequest(request.scope, request.receive)


class JsonRoute(APIRoute):
    """The class of every route that takes JSON: `APIRouter(route_class=JsonRoute)`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler, for a request that reads JSON strictly."""
        handler = super().get_route_handler()

        async def strict(request: Request) -> Response:
            # one that has read its body may not be replaced
            return await handler(strictly(request))

        return strict
