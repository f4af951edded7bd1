"""Collects the complete answers that the result of a task refers to."""

from __future__ import annotations

from typing import Any

from app.engine.result import json_document, placeholder
from app.exceptions import InvalidRequest

MOST_BYTES = 1 << 27
"""Largest total size [byte], before compression, of the answers that one result refers to."""


class AnswerCollector:
    """Collects complete answers for `TaskResult.stored`."""

    def __init__(self) -> None:
        self._answers: list[bytes] = []

    def add(self, content: dict[str, Any]) -> str:
        """Adds an answer and returns the placeholder of its path. Raises InvalidRequest above MOST_BYTES."""
        self._answers.append(json_document(content))
        if sum(map(len, self._answers)) > MOST_BYTES:
            message = "The answers are too large together: use a longer `sample_period`, or ask for fewer"
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return placeholder(len(self._answers) - 1)

    @property
    def stored(self) -> tuple[bytes, ...]:
        """The answers so far."""
        return tuple(self._answers)
