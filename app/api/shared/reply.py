"""How a request is answered: at once when its work is done, or by events from the begin of the work
on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request, Response

from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.event_stream import EVENT_STREAM, EventStream, Work
from joulepath.app.http.handlers import result_response
from joulepath.app.http.weights import is_wanted
from joulepath.app.schemas.examples.progress import EVENTS
from joulepath.optimizer.progress import no_listener

BY_EVENTS: dict[str, Any] = {EVENT_STREAM: {"schema": {"type": "string"}, "example": EVENTS}}
"""Content of the 200 of a route whose progress can be listened to."""


@dataclass(frozen=True)
class Reply:
    """The answer that the client of a request wants."""

    request: Request
    by_events: bool

    async def of(self, work: Work) -> Response:
        """The response with what `work` returns. If the client closes the connection, the work is
        cancelled.
        """
        if self.by_events:
            return EventStream(self.request, work)
        return result_response(await unless_disconnected(self.request, work(no_listener)))


async def _reply(request: Request) -> Reply:
    return Reply(request, is_wanted(request, EVENT_STREAM))


ServiceReply = Annotated[Reply, Depends(_reply)]
