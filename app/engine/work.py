"""Deferrable work: tasks taken by workers from a common queue, and their outcomes."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from joulepath.app.engine.listening import Listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.optimizer.progress import no_listener

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
