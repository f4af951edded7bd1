"""Kept answers that a task needs: those that its request names, and the moves of a cycle among them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

import orjson

from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import PartsNeeded


@dataclass(frozen=True, kw_only=True)
class WithKeptAnswers:
    """Base of such a task. `kept` holds kept answers (JSON) by their ids or paths."""

    kept: dict[str, bytes] = field(default_factory=dict)

    def run(self, deadline: float) -> TaskResult:
        """The task's result, within about `deadline` seconds. Raises PartsNeeded."""
        raise NotImplementedError

    def with_kept(self, found: dict[str, bytes]) -> Self:
        """The same task with more kept answers at hand."""
        return replace(self, kept=self.kept | found)

    def answers(self, names: list[str]) -> list[Any]:
        """The kept answers of these names. Raises PartsNeeded with those that are not at hand, and InvalidRequest."""
        missing = [name for name in names if name not in self.kept]
        if missing:
            raise PartsNeeded(missing)
        return [_document(self.kept[name]) for name in names]


def _document(body: bytes) -> Any:
    content = orjson.loads(body)
    if not isinstance(content, dict):
        raise InvalidRequest([{"loc": ["body", "answer"], "msg": "This kept answer is no motion"}])
    return content
