"""How a request is answered: at once when its work is done, or by events from the begin of the work
on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request, Response

from joulepath.app.api.shared.dependencies import ServiceArmEngine, ServiceSettings
from joulepath.app.api.shared.parameters import WithDeadline, deadline_of
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.event_stream import EVENT_STREAM, EventStream, Work
from joulepath.app.http.handlers import result_response
from joulepath.app.http.weights import is_wanted
from joulepath.app.schemas.examples.progress import EVENTS
from joulepath.app.tasks.arm_engine import ArmEngine
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


@dataclass(frozen=True)
class Tasks:
    """Runs the tasks of a request, until its client closes the connection."""

    request: Request
    engine: ArmEngine
    longest: float
    """Longest time of a task [s]."""

    @property
    def request_id(self) -> str:
        """The id of the request."""
        request_id: str = self.request.state.id
        return request_id

    async def result(self, task: Task, body: WithDeadline | None = None) -> TaskResult:
        """The result of a task, by the deadline of the request's body; None: in the longest time.

        Raises InvalidRequest for a later deadline, ClientDisconnected, and what `ArmEngine.run`
        raises.
        """
        deadline = self.longest if body is None else deadline_of(body, self.longest)
        return await unless_disconnected(self.request, self.engine.run(task, deadline))

    async def answer(self, task: Task, body: WithDeadline | None = None) -> Response:
        """The response with the result of a task, as `result`."""
        return result_response(await self.result(task, body))


async def _tasks(request: Request, engine: ServiceArmEngine, settings: ServiceSettings) -> Tasks:
    return Tasks(request, engine, settings.max_deadline)


ServiceTasks = Annotated[Tasks, Depends(_tasks)]
