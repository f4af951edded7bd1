"""Routes with large JSON bodies, parsed by workers."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Annotated, Any

from fastapi import Depends, Request, Response
from fastapi.routing import APIRoute
from pydantic import BaseModel

from joulepath.app.api.shared.reply import ServiceTasks
from joulepath.app.http.json_route import JsonRoute, media_type, strictly
from joulepath.app.http.weights import JSON
from joulepath.app.tasks.read_body import HeldBody, ReadBodyTask, held

LARGE = 1 << 16
"""Size [byte] above which a worker reads a body.

The event loop needs a few milliseconds to read a body of this size.
"""

_NAME = "body"
"""Name of the parameter of a route for the body."""


class LargeBodyRoute(JsonRoute):
    """A route with one JSON body; it receives a large body as a `HeldBody` instead of its model."""

    def __init__(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        signature = inspect.signature(endpoint, eval_str=True)
        self._for_large: APIRoute | None = None
        if _NAME in signature.parameters:
            model = signature.parameters[_NAME].annotation
            self._for_large = APIRoute(path, _taking_held(endpoint, signature, model), **options)
        super().__init__(path, endpoint, **options)

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Handler that selects the route for small or for large bodies."""
        handle = super().get_route_handler()
        if self._for_large is None:
            return handle
        handle_large = self._for_large.get_route_handler()

        async def handle_either(request: Request) -> Response:
            request = strictly(request)
            is_large = (
                media_type(request.headers) == JSON and sum(map(len, await request.parts())) > LARGE
            )
            return await (handle_large if is_large else handle)(request)

        return handle_either


def _taking_held(
    endpoint: Callable[..., Any], signature: inspect.Signature, model: type[BaseModel]
) -> Callable[..., Any]:
    """The endpoint with a body parsed by a worker."""

    async def body(request: Request, tasks: ServiceTasks) -> HeldBody:
        parts = await strictly(request).parts()
        return held(await tasks.result(ReadBodyTask(model, parts, tasks.request_id)))

    @wraps(endpoint)
    async def taking_held(**arguments: Any) -> Any:
        return await endpoint(**arguments)

    parameters = [
        each.replace(
            annotation=Annotated[Any, Depends(body)] if each.name == _NAME else each.annotation
        )
        for each in signature.parameters.values()
    ]
    declared = signature.replace(parameters=parameters)
    taking_held.__signature__ = declared  # type: ignore[attr-defined]
    return taking_held
