"""Work that can wait: tasks that one worker after another takes from a common heap, and what
becomes of each.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.optimizer.progress import Tell, no_listener

SHORT = 0.05
"""Most that short work takes [s]."""
Ended = TaskResult | Exception
"""How a task ends: its result, or the error that it raises."""


@dataclass(eq=False)
class Work:
    """A task, for which `deadline` [s] is left once work on it begins. `ended` gets what becomes of
    it.

    `stoppable`: a caller may take its worker. `tell` gets what the task finds. `expected` [s] is
    what it may take. `is_small`: its pickled task has a few kilobytes at most.
    """

    task: Task
    deadline: float
    ended: Callable[[Ended], object]
    stoppable: bool = True
    tell: Tell = no_listener
    expected: float = float("inf")
    is_small: bool = False

    @property
    def is_short(self) -> bool:
        """Whether it may lie in the pipe of a worker that is at work: it holds up neither a caller
        nor the pipe.
        """
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
    tell: Tell = no_listener,
) -> TaskResult:
    """The result of one task from what runs many. Raises what becomes of it otherwise, and what
    `run` raises.
    """
    found: list[Ended] = []
    await run(taking(Work(task, deadline, found.append, stoppable, tell)))
    (ended,) = found
    if isinstance(ended, Exception):
        raise ended
    return ended
