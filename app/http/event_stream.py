"""Answers by server-sent events: events of the work as JSON, and finally its answer."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from fastapi import Request
from starlette.responses import StreamingResponse
from starlette.types import Message, Receive, Scope, Send

from joulepath.app.convert.fields import fields
from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.handlers import problem_response
from joulepath.optimizer.exceptions import DeclaredError
from joulepath.optimizer.presentation.gap import optimality_gap
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Event, Tell, only_news

logger = logging.getLogger(__name__)

EVENT_STREAM = "text/event-stream"
EVENT_SCHEMA = {
    "type": "object",
    "properties": {name: {"type": "string"} for name in ("id", "event", "data")},
}
"""One event, in the OpenAPI document."""
Work = Callable[[Tell], Coroutine[Any, Any, TaskResult]]


@dataclass(frozen=True)
class StreamSettings:
    """Settings of event streams."""

    pause: float = 15.0
    """Time [s] without an event after which a comment keeps the stream alive in proxies."""
    most_waiting: int = 1000
    """Most unread events of a client; the oldest ones are dropped beyond it."""


STREAM = StreamSettings()

EVENT_STREAM_HEADERS = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
COMMENT = b": working\n\n"


class EventStream(StreamingResponse):
    """The events of `work`, then `answer` with its result or `problem` with its error.

    The stream begins with the first event. An earlier error is raised here and answered as an
    ordinary problem. If the client closes the connection, the work is cancelled.
    """

    def __init__(self, request: Request, work: Work) -> None:
        super().__init__((), headers=EVENT_STREAM_HEADERS, media_type=EVENT_STREAM)
        self._request, self._work = request, work
        self._begun = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Sends the events. Raises ClientDisconnected, and errors of the work before the first
        event.
        """
        await unless_disconnected(self._request, self._answer(send))

    async def _answer(self, send: Send) -> None:
        waiting: deque[Event] = deque(maxlen=STREAM.most_waiting)
        bell = asyncio.Event()

        def told(event: Event) -> None:
            waiting.append(event)
            bell.set()

        # A preempted request starts again: its client need not know.
        working = asyncio.create_task(self._work(only_news(told)))
        working.add_done_callback(lambda _: bell.set())
        try:
            while not working.done() or waiting:
                await self._rung(bell, send)
                while waiting:
                    name, content = to_event(waiting.popleft())
                    await self._send(send, name, json_document(content))
            await self._conclude(working, send)
        finally:
            working.cancel()
            await asyncio.gather(working, return_exceptions=True)

    async def _rung(self, bell: asyncio.Event, send: Send) -> None:
        """Waits until the bell rings, and silences it."""
        while not bell.is_set():
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(STREAM.pause):
                    await bell.wait()
            if not bell.is_set() and self._begun:
                await send(_body(COMMENT))
        bell.clear()

    async def _conclude(self, working: asyncio.Task[TaskResult], send: Send) -> None:
        """Sends the last event."""
        try:
            await self._send(send, "answer", working.result().document)
        except Exception as error:
            if not self._begun:
                raise
            if not isinstance(error, DeclaredError):
                logger.exception("unforeseen error", extra={"request_id": self._request.state.id})
            response = await problem_response(self._request, error)
            await self._send(send, "problem", bytes(response.body))
        await send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _send(self, send: Send, name: str, document: bytes) -> None:
        if not self._begun:
            self._begun = True
            await send(
                {
                    "type": "http.response.start",
                    "status": self.status_code,
                    "headers": self.raw_headers,
                }
            )
        await send(_body(b"event: %s\ndata: %s\n\n" % (name.encode(), document)))


def _body(content: bytes) -> Message:
    return {"type": "http.response.body", "body": content, "more_body": True}


def to_event(event: Event) -> tuple[str, dict[str, Any]]:
    """Name and content of an event."""
    if isinstance(event, CandidatesFound):
        return "candidates", fields(event, "total")
    if isinstance(event, CandidateTried):
        return "candidate", fields(event, "index", "status", "bound", "energy")
    gap = None if event.bound is None else optimality_gap(event.bound, event.energy)
    return "incumbent", {
        **fields(event, "energy", "duration", "bound"),
        "gap": gap,
        **fields(event, "q_goal"),
    }
