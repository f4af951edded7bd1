"""The result of a task: an encoded document. It knows nothing of HTTP, so that any caller of the engine can use it."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import orjson

_ID = b'{"id":"'


@dataclass(frozen=True)
class AnswerFigures:
    """What lists show of an answer: robot, energy [J], duration [s] and status; None if it has none."""

    robot: str | None = None
    energy: float | None = None
    duration: float | None = None
    status: str | None = None


@dataclass(frozen=True)
class StoredAnswer:
    """A complete answer (JSON), the id under which it is to be stored, and what lists show of it.

    The task chooses the id, so that the document holds the final path from the first. Nothing is ever searched and
    replaced in a document, which repeats texts of the caller.
    """

    id: str
    body: bytes
    figures: AnswerFigures = AnswerFigures()

    @property
    def path(self) -> str:
        """Path of the answer in the service."""
        return f"/answers/{self.id}"


@dataclass(frozen=True)
class TaskResult:
    """A document and its media type. A task that fails raises an exception instead.

    `stored` are complete answers that belong into the database before the document is sent: it refers to them.
    `kept_as` is the id under which the document itself is to be kept; its last field, `answer`, has the path. `figures`
    are what lists show of it.
    `is_optimal`: no more time would make it better. `age` [s] is that of a document that was computed before. `motions`
    are those that it used or found of a cell, by their keys: later rounds may have them in common.
    """

    document: bytes
    media_type: str
    stored: tuple[StoredAnswer, ...] = ()
    kept_as: str | None = None
    figures: AnswerFigures = AnswerFigures()
    is_optimal: bool = False
    age: int | None = None
    motions: Mapping[str, bytes] = field(default_factory=dict)

    @classmethod
    def of_json(cls, content: Mapping[str, Any], stored: tuple[StoredAnswer, ...] = ()) -> TaskResult:
        """A JSON document: see `json_document`."""
        return cls(json_document(content), "application/json", stored)

    @classmethod
    def of_kept_json(
        cls, content: Mapping[str, Any], figures: AnswerFigures, stored: tuple[StoredAnswer, ...] = ()
    ) -> TaskResult:
        """A JSON document that is to be kept, with its path as the last field, `answer`."""
        kept = StoredAnswer(str(uuid.uuid4()), b"")
        document = json_document({**content, "answer": kept.path})
        is_optimal = figures.status == "optimal"
        return cls(document, "application/json", stored, kept.id, figures, is_optimal)

    def without_path(self) -> TaskResult:
        """The same document, which was not kept: its field `answer` is null."""
        assert self.kept_as is not None
        end = _last_field(self.kept_as)
        assert self.document.endswith(end)
        return replace(self, document=self.document[: -len(end)] + b',"answer":null}', kept_as=None)

    def with_id(self, request_id: str) -> TaskResult:
        """The same document for another request: its first field, `id`, is that of the request."""
        assert self.document.startswith(_ID)
        # no id has a quotation mark
        rest = self.document[self.document.index(b'"', len(_ID)) :]
        return replace(self, document=_ID + request_id.encode() + rest)

    def copied(self, request_id: str) -> TaskResult:
        """The same document for another request, to be kept as another answer."""
        own = self.with_id(request_id)
        if self.kept_as is None or not own.document.endswith(end := _last_field(self.kept_as)):
            return replace(own, kept_as=str(uuid.uuid4()))
        new = str(uuid.uuid4())
        return replace(own, document=own.document[: -len(end)] + _last_field(new), kept_as=new)

    @classmethod
    def of_csv(cls, table: str, stored: tuple[StoredAnswer, ...] = ()) -> TaskResult:
        """A CSV document."""
        return cls(table.encode(), "text/csv", stored)


def _last_field(answer_id: str) -> bytes:
    return b',"answer":"%s"}' % StoredAnswer(answer_id, b"").path.encode()


def json_document(content: Mapping[str, Any]) -> bytes:
    """`content` as JSON. NumPy arrays must be C-contiguous; a number that is not finite becomes null."""
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)
