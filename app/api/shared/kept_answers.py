"""Runs tasks that need kept answers: a worker says which, and gets them from the database."""

from __future__ import annotations

from functools import partial
from typing import Protocol, Self

from joulepath.app.engine.result import TaskResult
from joulepath.app.engine.task import Task
from joulepath.app.exceptions.stored import PartsNeeded
from joulepath.app.store import answers
from joulepath.app.store.store import Store
from joulepath.app.tasks.arm_engine import ArmEngine

PREFIX = "/answers/"
# an id, then the moves of a cycle
_LOOK_UPS = 2


class _NeedsAnswers(Task, Protocol):
    def with_kept(self, found: dict[str, bytes]) -> Self:
        """The same task with more kept answers at hand."""
        ...


async def with_kept_answers(task: _NeedsAnswers, engine: ArmEngine, store: Store, deadline: float) -> TaskResult:
    """The task's result, once it has the kept answers that it needs. Raises what it raises, and UnknownAnswer."""
    for _ in range(_LOOK_UPS + 1):
        try:
            return await engine.run(task, deadline)
        except PartsNeeded as needed:
            task = task.with_kept({name: await _kept(store, name) for name in dict.fromkeys(needed.names)})
    raise AssertionError("an answer needs its own parts only")


async def _kept(store: Store, name: str) -> bytes:
    _, body = await store.read(partial(answers.get, answer_id=name.removeprefix(PREFIX)))
    return body
