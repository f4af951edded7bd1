"""The result of a task: an encoded document, independent of HTTP."""

from __future__ import annotations

import csv
import re
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from io import StringIO
from typing import Any

import orjson

from joulepath.app.answers.declared import as_json
from joulepath.app.answers.envelope import AnswerFigures

_HEAD = re.compile(rb'\{"request":"([^"]*)","id":(?:null|"([^"]*)")')
"""The first fields of an answer: the id of its request, and its own. No id has a quotation mark."""
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of the texts that spreadsheets compute."""


def path_of_answer(id: str) -> str:
    """Path of a kept answer in the service."""
    return f"/answers/{id}"


@dataclass(frozen=True)
class StoredAnswer:
    """A complete answer as JSON, its id in the database, and its figures in lists.

    The task chooses the id, so that the document contains its final path from the start. Documents
    repeat texts of the caller and are never edited by search and replace.
    """

    id: str
    body: bytes
    figures: AnswerFigures = field(default_factory=AnswerFigures)
    kind: str | None = None
    """Endpoint of the answer; None for that of all answers of its result."""
    asked: bytes | None = None
    """Its request as it was sent (JSON); None if it is kept elsewhere or is that of another."""

    @property
    def path(self) -> str:
        """Path of the answer in the service."""
        return path_of_answer(self.id)


@dataclass(frozen=True)
class TaskResult:
    """A document and its media type. A task that fails raises an exception instead.

    `stored` are complete answers to be stored before the document, which refers to them, is sent.
    `kept_as` is the id under which the document itself is to be kept; it is in the second field,
    `id`, and the path in the last field, `answer`. `figures` are its figures in lists. `is_optimal`
    says that more time would not improve it. `age` [s] is the age of a repeated document. `motions`
    are the motions of a cell used or found by the task, by their keys, for later cycles. `asked` is
    the request as it was sent, to be kept with the document.
    """

    document: bytes
    media_type: str
    stored: tuple[StoredAnswer, ...] = ()
    kept_as: str | None = None
    figures: AnswerFigures = field(default_factory=AnswerFigures)
    is_optimal: bool = False
    age: int | None = None
    motions: Mapping[str, bytes] = field(default_factory=dict)
    asked: bytes | None = None

    @classmethod
    def of_json(cls, content: Any, stored: tuple[StoredAnswer, ...] = ()) -> TaskResult:
        """A JSON document: see `json_document`."""
        return cls(json_document(content), "application/json", stored)

    @classmethod
    def of_kept_json(
        cls,
        content: Any,
        figures: AnswerFigures,
        stored: tuple[StoredAnswer, ...] = (),
        asked: bytes | None = None,
    ) -> TaskResult:
        """A JSON document to be kept, with `request` and `id` first and `answer` last."""
        return cls(
            json_document(content),
            "application/json",
            stored,
            figures=figures,
            is_optimal=figures.status == "optimal",
            asked=asked,
        ).kept()

    def kept(self) -> TaskResult:
        """The same document, to be kept under an id of its own."""
        return self._under(str(uuid.uuid4()))

    def not_kept(self) -> TaskResult:
        """The same document without keeping it: `id` and `answer` are null."""
        return self._under(None)

    def for_request(self, request_id: str) -> TaskResult:
        """The same document with the id of another request in `request`."""
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
    def of_csv(
        cls, rows: Iterable[Iterable[Any]], stored: tuple[StoredAnswer, ...] = ()
    ) -> TaskResult:
        """A CSV document: see `csv_document`."""
        return cls(csv_document(rows), "text/csv", stored)


def _last_field(answer_id: str | None) -> bytes:
    return (
        b',"answer":null}'
        if answer_id is None
        else b',"answer":"%s"}' % StoredAnswer(answer_id, b"").path.encode()
    )


def json_document(content: Any) -> bytes:
    """An object of a declared class or a dict as JSON; non-finite numbers become null."""
    return orjson.dumps(
        content,
        default=as_json,
        # times end in Z, as pydantic writes them
        option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_PASSTHROUGH_DATACLASS | orjson.OPT_UTC_Z,
    )


def csv_document(rows: Iterable[Iterable[Any]]) -> bytes:
    """Rows as CSV, the head included; None is an empty cell.

    Texts that a spreadsheet would compute, such as `=1+1`, begin with an apostrophe.
    """
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(_inert, row) for row in rows)
    return text.getvalue().encode()


def _inert(cell: Any) -> Any:
    return f"'{cell}" if isinstance(cell, str) and cell.startswith(_FORMULA) else cell
