"""What the engine runs."""

from __future__ import annotations

from typing import Protocol

from app.engine.result import TaskResult


class Task(Protocol):
    """A picklable piece of work for a worker process."""

    @property
    def request_id(self) -> str:
        """Id of the request that the task belongs to; the worker's log names it."""

    def run(self, deadline: float) -> TaskResult:
        """The result, within about `deadline` seconds.

        A JoulepathError or ServiceError reaches the caller of `Engine.run` as it is. Any other exception is a defect:
        the worker logs it, and the caller gets TaskFailed.
        """
