"""Tasks of the engine, run in this process or in a worker; and deferrable work: tasks that workers
take from a common queue, with their outcomes.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Protocol

from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InternalError
from joulepath.optimizer.deadline import Stopped, checkpoint, is_stopped
from joulepath.optimizer.exceptions import DeclaredError
from joulepath.optimizer.progress import no_listener

logger = logging.getLogger(__name__)


class Task(Protocol):
    """A picklable piece of work for a worker process."""

    @property
    def request_id(self) -> str:
        """Id of the request, for the worker's log."""

    def run(self, deadline: float) -> TaskResult:
        """The result, within about `deadline` seconds; events go to `listener()`.

        The caller of `Engine.run` receives a JoulepathError or ServiceError unchanged. Any other
        exception is a defect: the worker logs it, and the caller receives InternalError.
        """


def outcome(task: Task, deadline: float) -> TaskResult | DeclaredError | Stopped:
    """The task's result, the error for its caller, or Stopped; all of them can be pickled."""
    ended: TaskResult | DeclaredError
    try:
        checkpoint()
        ended = task.run(deadline)
    except DeclaredError as error:
        ended = error
    except Stopped as stopped:
        return stopped
    except Exception:
        if not is_stopped():
            logger.exception("unforeseen error", extra={"request_id": task.request_id})
        ended = InternalError()
    # A stopped task may end as if its deadline had passed: this is not an answer.
    return Stopped() if is_stopped() else ended


SHORT = 0.05
"""Longest expected time of short work [s]."""
Ended = TaskResult | Exception
"""Outcome of a task: its result or its error."""


@dataclass(eq=False)
class Work:
    """A task with `deadline` [s] from its start, and a function `ended` for its outcome.

    `stoppable`: a caller may take its worker. `tell` receives the events of the task. `expected`
    [s] is its likely time. `is_small`: the pickled task has a few kilobytes at most.
    """

    task: Task
    deadline: float
    ended: Callable[[Ended], object]
    stoppable: bool = True
    tell: Listener = no_listener
    expected: float = float("inf")
    is_small: bool = False

    @property
    def is_short(self) -> bool:
        """Whether it may wait in the pipe of a busy worker without delaying callers."""
        return self.is_small and self.expected <= SHORT


Take = Callable[[], Work | None]
"""Takes the next work from the heap; None if there is none. May be called in any thread."""


def taking(*works: Work) -> Take:
    """Takes these works, one after another."""
    left = list(works)
    return lambda: left.pop(0) if left else None


async def result_of(
    run: Callable[[Take], Awaitable[None]],
    task: Task,
    deadline: float,
    stoppable: bool = True,
    tell: Listener = no_listener,
) -> TaskResult:
    """The result of one task, run by a function for many. Raises the error of the task or of
    `run`."""
    found: list[Ended] = []
    await run(taking(Work(task, deadline, found.append, stoppable, tell)))
    (ended,) = found
    if isinstance(ended, Exception):
        raise ended
    return ended
