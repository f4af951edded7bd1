"""Routes whose JSON bodies are read strictly: no name twice, and errors that say line and column."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from app.convert.json_text import parsed_json
from app.exceptions import InvalidRequest
from app.http.refused_body import RefusedBody


class JsonRequest(Request):
    """A request that reads JSON strictly."""

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
