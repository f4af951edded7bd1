"""The result of a task: an encoded document. It knows nothing of HTTP, so that any caller of the engine can use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import orjson


@dataclass(frozen=True)
class TaskResult:
    """A document and its media type. A task that fails raises an exception instead.

    `stored` are complete answers (JSON) that belong into the database. Where the document refers to the k-th of them,
    it holds `placeholder(k)`, which gives way to the answer's path: see `app.store.store_answers`.
    """

    document: bytes
    media_type: str
    stored: tuple[bytes, ...] = ()

    @classmethod
    def of_json(cls, content: Mapping[str, Any], stored: tuple[bytes, ...] = ()) -> TaskResult:
        """A JSON document: see `json_document`."""
        return cls(json_document(content), "application/json", stored)

    @classmethod
    def of_csv(cls, table: str, stored: tuple[bytes, ...] = ()) -> TaskResult:
        """A CSV document."""
        return cls(table.encode(), "text/csv", stored)


def json_document(content: Mapping[str, Any]) -> bytes:
    """`content` as JSON. NumPy arrays must be C-contiguous; a number that is not finite becomes null."""
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)


def placeholder(k: int) -> str:
    """Text that stands for the path of the k-th stored answer.

    It contains a control character that no text of a client may contain.
    """
    return f"\x7fstored/{k}\x7f"
