"""The result of a task: an encoded document. It knows nothing of HTTP, so that any caller of the
engine can use it.
"""

from __future__ import annotations

import re
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import orjson

from joulepath.app.answers.declared import as_json
from joulepath.app.answers.envelope import AnswerFigures

_HEAD = re.compile(rb'\{"request":"([^"]*)","id":(?:null|"([^"]*)")')
"""The first fields of an answer: the id of its request, and its own. No id has a quotation mark."""


@dataclass(frozen=True)
class StoredAnswer:
    """A complete answer (JSON), the id under which it is to be stored, and what lists show of it.

    The task chooses the id, so that the document holds the final path from the first. Nothing is
    ever searched and replaced in a document, which repeats texts of the caller.
    """

    id: str
    body: bytes
    figures: AnswerFigures = field(default_factory=AnswerFigures)

    @property
    def path(self) -> str:
        """Path of the answer in the service."""
        return f"/answers/{self.id}"


@dataclass(frozen=True)
class TaskResult:
    """A document and its media type. A task that fails raises an exception instead.

    `stored` are complete answers that belong into the database before the document is sent: it
    refers to them. `kept_as` is the id under which the document itself is to be kept: its field
    `id`, the second one, has it, and the path is in the last one, `answer`, if there is one.
    `figures` are what lists show of it. `is_optimal`: no more time would make it better. `age` [s]
    is that of a document that was computed before. `motions` are those that it used or found of a
    cell, by their keys: later rounds may have them in common.
    """

    document: bytes
    media_type: str
    stored: tuple[StoredAnswer, ...] = ()
    kept_as: str | None = None
    figures: AnswerFigures = field(default_factory=AnswerFigures)
    is_optimal: bool = False
    age: int | None = None
    motions: Mapping[str, bytes] = field(default_factory=dict)

    @classmethod
    def of_json(cls, content: Any, stored: tuple[StoredAnswer, ...] = ()) -> TaskResult:
        """A JSON document: see `json_document`."""
        return cls(json_document(content), "application/json", stored)

    @classmethod
    def of_kept_json(
        cls, content: Any, figures: AnswerFigures, stored: tuple[StoredAnswer, ...] = ()
    ) -> TaskResult:
        """A JSON document that is to be kept. Its fields `request` and `id` come first, `answer`
        comes last.
        """
        is_optimal = figures.status == "optimal"
        return cls(
            json_document(content), "application/json", stored, None, figures, is_optimal
        ).kept()

    def kept(self) -> TaskResult:
        """The same document, to be kept under an id of its own."""
        return self._under(str(uuid.uuid4()))

    def not_kept(self) -> TaskResult:
        """The same document, which is not kept: its fields `id` and `answer` are null."""
        return self._under(None)

    def for_request(self, request_id: str) -> TaskResult:
        """The same document as the answer to another request: its field `request` is the id of
        that.
        """
        head = _HEAD.match(self.document)
        assert head is not None
        start, end = head.span(1)
        return replace(
            self, document=self.document[:start] + request_id.encode() + self.document[end:]
        )

    def copied(self, request_id: str) -> TaskResult:
        """The same document for another request, to be kept as another answer."""
        return self.for_request(request_id).kept()

    def _under(self, answer_id: str | None) -> TaskResult:
        head = _HEAD.match(self.document)
        if head is None:
            # identifications have a resource of their own
            return replace(self, kept_as=answer_id)
        own = b"null" if answer_id is None else b'"%s"' % answer_id.encode()
        first, rest = b'{"request":"%s","id":%s' % (head[1], own), self.document[head.end() :]
        last = _last_field(None if head[2] is None else head[2].decode())
        if rest.endswith(last):
            rest = rest[: -len(last)] + _last_field(answer_id)
        return replace(self, document=first + rest, kept_as=answer_id)

    @classmethod
    def of_csv(cls, table: str, stored: tuple[StoredAnswer, ...] = ()) -> TaskResult:
        """A CSV document."""
        return cls(table.encode(), "text/csv", stored)


def _last_field(answer_id: str | None) -> bytes:
    return (
        b',"answer":null}'
        if answer_id is None
        else b',"answer":"%s"}' % StoredAnswer(answer_id, b"").path.encode()
    )


def json_document(content: Any) -> bytes:
    """An object of a declared class, or a dict, as JSON. A number that is not finite becomes
    null."""
    return orjson.dumps(
        content,
        default=as_json,
        option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_PASSTHROUGH_DATACLASS,
    )
