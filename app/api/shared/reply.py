"""Runs the tasks of a request, and answers it after the work or by a stream of events during it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends, Request, Response

from joulepath.app.api.shared.dependencies import (
    ServiceArmEngine,
    ServiceClient,
    ServiceSettings,
    ServiceStore,
)
from joulepath.app.api.shared.parameters import WithDeadline, deadline_of
from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.http.disconnect import unless_disconnected
from joulepath.app.http.event_stream import EVENT_STREAM, EventStream, Work
from joulepath.app.http.handlers import result_response
from joulepath.app.http.weights import is_wanted
from joulepath.app.schemas.examples.progress import EVENTS
from joulepath.app.store.cache import Asked
from joulepath.app.store.store_answers import keep_answer, store_answers
from joulepath.optimizer.progress import no_listener

BY_EVENTS: dict[str, Any] = {EVENT_STREAM: {"schema": {"type": "string"}, "example": EVENTS}}
"""Content of the response 200 of routes with an event stream of their progress."""


@dataclass(frozen=True)
class Tasks:
    """Runs the tasks of a request, until its client closes the connection."""

    request: Request
    engine: ServiceArmEngine
    store: ServiceStore
    settings: ServiceSettings
    client: ServiceClient

    @property
    def request_id(self) -> str:
        """The id of the request."""
        request_id: str = self.request.state.id
        return request_id

    def deadline(self, body: WithDeadline | None = None) -> float:
        """Time for a request with the given body [s]; None: the longest time of the service.

        Raises:
            InvalidRequest: the deadline in the body is later than the longest time.
        """
        longest = self.settings.max_deadline
        return longest if body is None else deadline_of(body, longest)

    async def result(self, task: Task, body: WithDeadline | None = None) -> TaskResult:
        """Result of a task within the deadline of the body; None: within the longest time.

        Raises:
            InvalidRequest: the deadline in the body is later than the longest time.
            ClientDisconnected: the client closed the connection.
            DeclaredError: any error of `ArmEngine.run`.
        """
        return await unless_disconnected(self.request, self.engine.run(task, self.deadline(body)))

    async def answer(self, task: Task, body: WithDeadline | None = None) -> Response:
        """Response with the result of a task; arguments and errors as for `result`."""
        return result_response(await self.result(task, body))

    async def kept(
        self,
        kind: str,
        result: TaskResult,
        asked: Asked | None = None,
        cell: str | None = None,
        parts: str = "optimize",
    ) -> TaskResult:
        """Store the answers referenced by a result, and the result itself under `result.kept_as`.

        Args:
            kind: endpoint of the result.
            result: the result.
            asked: key that identifies equal requests, which this result will answer; None: the
                result answers no later request.
            cell: cell of a cycle whose motions are kept; None: no motions are kept.
            parts: endpoint of the referenced answers.

        Returns:
            The result to send.

        Raises:
            StoreUnavailable: the referenced answers cannot be stored.
        """
        store, settings, owner = self.store, self.settings, self.client.owner
        result = await store_answers(store, settings, parts, result, owner, cell)
        if result.kept_as is None:
            return result
        return await keep_answer(store, settings, kind, result, owner, asked)

    async def search(self, kind: str, task: Task, body: WithDeadline) -> Response:
        """Response with the result of a search, stored by `kept`."""

        async def work(tell: Listener) -> TaskResult:
            return await self.kept(kind, await self.engine.run(task, self.deadline(body), tell))

        return await self.respond(work)

    async def respond(self, work: Work) -> Response:
        """Response with the result of `work`, as a stream of events if the client accepts one.

        If the client closes the connection, the work is cancelled.
        """
        if is_wanted(self.request, EVENT_STREAM):
            return EventStream(self.request, work)
        return result_response(await unless_disconnected(self.request, work(no_listener)))


async def _tasks(
    request: Request,
    engine: ServiceArmEngine,
    store: ServiceStore,
    settings: ServiceSettings,
    client: ServiceClient,
) -> Tasks:
    return Tasks(request, engine, store, settings, client)


ServiceTasks = Annotated[Tasks, Depends(_tasks)]
