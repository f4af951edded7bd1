"""Collects the complete answers that the result of a task refers to."""

from __future__ import annotations

import uuid
from typing import Any

from joulepath.app.engine.result import StoredAnswer, json_document
from joulepath.app.exceptions import InvalidRequest
from joulepath.app.tasks.answer_figures import figures_of

MOST_BYTES = 1 << 26
"""Largest total size [byte], before compression, of the answers that one result refers to."""


class AnswerCollector:
    """Collects complete answers for `TaskResult.stored`."""

    def __init__(self) -> None:
        self._answers: list[StoredAnswer] = []

    def add(self, content: dict[str, Any]) -> str:
        """Adds an answer and returns its path. Its fields `id` and `answer`, those that it has, are set.

        Raises InvalidRequest above MOST_BYTES.
        """
        answer_id = str(uuid.uuid4())
        path = StoredAnswer(answer_id, b"").path
        own = {"id": answer_id, "answer": path}
        own_of = {name: value for name, value in own.items() if name in content}
        answer = StoredAnswer(answer_id, json_document({**content, **own_of}), figures_of(content))
        self._answers.append(answer)
        if sum(len(each.body) for each in self._answers) > MOST_BYTES:
            message = "The answers are too large together: use a longer `sample_period`, or ask for fewer"
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return answer.path

    @property
    def stored(self) -> tuple[StoredAnswer, ...]:
        """The answers so far."""
        return tuple(self._answers)
