"""Collection of the complete answers referenced by the result of a task."""

from __future__ import annotations

import uuid
from dataclasses import replace

from joulepath.app.answers.envelope import Answer
from joulepath.app.engine.result import StoredAnswer, json_document
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.optimizer.presentation.declared_fields import shown_fields

MOST_BYTES = 1 << 26
"""Largest total size [byte] of the answers of one result, before compression."""


class AnswerCollector:
    """Collects complete answers for `TaskResult.stored`."""

    def __init__(self) -> None:
        self._answers: list[StoredAnswer] = []

    def add(self, content: Answer, endpoint: str | None = None, asked: bytes | None = None) -> str:
        """Adds an answer, sets its fields `id` and `answer`, and returns its path.

        `endpoint` is its kind where it differs from that of most answers of the result, and `asked`
        its request (JSON).

        Raises InvalidRequest above MOST_BYTES.
        """
        answer_id = str(uuid.uuid4())
        own = {"id": answer_id, "answer": StoredAnswer(answer_id, b"").path}
        kind: type = type(content)
        kept = replace(content, **{name: own[name] for name in own.keys() & shown_fields(kind)})
        answer = StoredAnswer(answer_id, json_document(kept), content.figures, endpoint, asked)
        self._answers.append(answer)
        if sum(len(each.body) for each in self._answers) > MOST_BYTES:
            message = (
                "The answers are too large together: use a longer `sample_period`, or ask for fewer"
            )
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return answer.path

    @property
    def stored(self) -> tuple[StoredAnswer, ...]:
        """The answers so far."""
        return tuple(self._answers)
