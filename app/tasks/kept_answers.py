"""Kept answers of a task: the answers named in its request, and moves of cycles."""

from __future__ import annotations

from typing import Any

import orjson

from joulepath.app.convert.given_answer import paths_of_moves
from joulepath.app.convert.items import item
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.stored import PartsNeeded


def kept_answers(names: list[str]) -> list[Any]:
    """The kept answers of these names. Raises PartsNeeded for missing ones, or InvalidRequest."""
    kept = {name: item(("answer", name)) for name in names}
    missing = [name for name, body in kept.items() if body is None]
    if missing:
        raise PartsNeeded(missing)
    return [_document(kept[name]) for name in names]


def answer_and_moves(given: str | dict[str, Any]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """An answer, given or kept under an id, and the kept answers of a cycle's moves.

    Raises as `kept_answers` and `paths_of_moves`.
    """
    answer = kept_answers([given])[0] if isinstance(given, str) else given
    return answer, kept_answers(paths_of_moves(answer))


def _document(body: bytes) -> Any:
    content = orjson.loads(body)
    if not isinstance(content, dict):
        raise InvalidRequest(
            [{"loc": ["body", "answer"], "msg": "This stored answer is not a motion"}]
        )
    return content
