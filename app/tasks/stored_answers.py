"""Collects whole answers that another answer refers to."""

from __future__ import annotations

from typing import Any

from app.exceptions import InvalidRequest
from app.tasks.task import json_reply

MOST_BYTES = 1 << 27
"""Of all answers that one refers to, before they are compressed."""


class AnswerCollector:
    """Collects whole answers for a reply that refers to them."""

    def __init__(self) -> None:
        self._bodies: list[bytes] = []

    def add(self, content: dict[str, Any]) -> str:
        """Takes an answer, and gives the mark that stands for its path. Raises InvalidRequest."""
        self._bodies.append(json_reply(content).body)
        if sum(map(len, self._bodies)) > MOST_BYTES:
            message = "The answers are too large together: lengthen `sample_period`, or ask for fewer"
            raise InvalidRequest([{"loc": ["body"], "msg": message}])
        return reference(len(self._bodies) - 1)

    def kept(self) -> tuple[bytes, ...]:
        """What was taken, for `Reply.kept`."""
        return tuple(self._bodies)


def reference(k: int) -> str:
    """The mark of the k-th of `Reply.kept`, with a character that no name of a caller's may hold."""
    return f"\x7fkept/{k}\x7f"
