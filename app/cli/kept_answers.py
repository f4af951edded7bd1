"""Tasks that need kept answers, such as the moves of a cycle: here they come from the database."""

from __future__ import annotations

from collections.abc import Awaitable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from joulepath.app.engine.result import TaskResult
    from joulepath.app.store.store import Store
    from joulepath.app.tasks.kept_answers import WithKeptAnswers


@dataclass
class WithStore:
    """A task that gets the kept answers that it needs from the database; it holds its result afterwards."""

    task: WithKeptAnswers
    request_id: str
    result: TaskResult | None = None

    def run(self, deadline: float) -> TaskResult:
        """The task's result."""
        from joulepath.app.exceptions.stored import PartsNeeded

        try:
            self.result = self.task.run(deadline)
        except PartsNeeded as needed:
            self.result = self.task.with_kept(_from_store(needed.names)).run(deadline)
        return self.result


def _from_store(names: list[str]) -> dict[str, bytes]:
    from joulepath.app.cli.store import in_store
    from joulepath.app.store import answers

    def body_of(name: str, store: Store) -> Awaitable[bytes]:
        return store.read(lambda session: answers.get(session, name.rpartition("/")[2])[1])

    return {name: in_store(partial(body_of, name)) for name in names}
