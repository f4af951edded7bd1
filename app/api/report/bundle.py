"""The attached documents of a report: request, answer and costs as JSON."""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from datetime import date
from typing import Any

import orjson

from joulepath.app.api.report.request import Kind
from joulepath.models.robot import Robot

NAME = "joulepath-report.json"
"""Name of the attachment."""
MARK = "joulepath_report"
"""Field identifying the document."""
LARGEST_BUNDLE = 1 << 28
"""Largest unpacked document [byte]."""
_SCRIPT = re.compile(rb'<script type="application/json" id="%s">([^<]*)</script>' % MARK.encode())
_STREAM = re.compile(rb"stream\r?\n")


@dataclass(frozen=True)
class Bundle:
    """The documents of a report.

    `answer` is the answer to the `request` to the endpoint `kind`; `moves` are the answers of the
    moves of a cycle, in order. Of a job, `answer` has its sums and `moves` its rows, see
    `job_rows`; of a placement, `moves` are the rows of `placed`. `log` is the log of a request to
    `POST /evaluate`: its settings, and its packed file in Base64.
    """

    kind: Kind
    request: dict[str, Any]
    answer: dict[str, Any]
    moves: list[dict[str, Any]]
    title: str | None
    costs: dict[str, Any]
    made: str
    """Date of the report, as YYYY-MM-DD."""
    version: str
    """Version of the service."""
    log: dict[str, Any] | None = None
    period: float | None = None
    """Time from one start of a motion or a cycle to the next [s]; None: its own."""
    advised: dict[str, Any] | None = None
    """Of a motion or a cycle, the energy of its wait and changes: see `AdviceAnswer`."""

    def packed(self) -> bytes:
        """The document."""
        return orjson.dumps({MARK: 1, **asdict(self)}, option=orjson.OPT_SERIALIZE_NUMPY)

    @property
    def motions(self) -> list[dict[str, Any]]:
        """The answers of `POST /optimize` in it."""
        return self.moves if self.kind == "cycle" else [self.answer]

    @property
    def what(self) -> str:
        """The subject of the report in one word."""
        return {
            "optimize": "motion",
            "cycle": "cycle",
            "job": "run",
            "evaluate": "log",
            "placement": "cycle",
        }[self.kind]

    def subtitle(self, robot: Robot) -> str:
        """Day and robot."""
        made = date.fromisoformat(self.made)
        return f"Energy report · {made:%-d %B %Y} · {robot.figures['title']}"

    def how_to_check(self, id: str | None) -> str:
        """How to check the report, with the id of its answer."""
        again = {
            "job": "certifies every motion and answers every request again",
            "evaluate": "reads and evaluates the log again",
            "placement": "certifies every motion and computes the cycles at both places again",
        }.get(self.kind, "certifies every motion and answers the request again")
        own = f" Id of the answer: {id}." if id else ""
        return (
            "The request and the answer are attached to this file. `joulepath check FILE` "
            f"extracts them, {again}, and compares the energies.{own}"
        )

    @property
    def foot(self) -> str:
        """The footer of a report of computed motions."""
        return f"Computed by joulepath {self.version}, not measured on hardware."


class NoReport(Exception):
    """The file is no report, or has nothing attached."""


def in_html(packed: bytes) -> str:
    """The element of a page with a document. Base64 needs no escaping."""
    text = base64.b64encode(zlib.compress(packed, 9)).decode()
    return f'<script type="application/json" id="{MARK}">{text}</script>'


def attached_to(file: bytes) -> Bundle:
    """The documents in a report, HTML or PDF. Raises NoReport."""
    for content in _candidates(file):
        try:
            document = orjson.loads(content)
        except orjson.JSONDecodeError:
            continue
        if isinstance(document, dict) and document.pop(MARK, None) == 1:
            try:
                return Bundle(**document)
            except TypeError:
                break
    raise NoReport


def _candidates(file: bytes) -> Iterator[bytes]:
    """Possible documents in a file."""
    if not file.startswith(b"%PDF"):
        yield from (_unpacked(base64.b64decode(each)) for each in _SCRIPT.findall(file))
        return
    # An embedded file is a stream directly after its dictionary.
    for begin in _STREAM.finditer(file):
        head = file[max(begin.start() - 400, 0) : begin.start()].rpartition(b" obj")[2]
        if b"/EmbeddedFile" in head:
            end = file.find(b"endstream", begin.end())
            content = file[begin.end() : end]
            yield _unpacked(content) if b"/FlateDecode" in head else content


def _unpacked(content: bytes) -> bytes:
    """The content of a zlib stream; empty if it is none."""
    try:
        return zlib.decompressobj().decompress(content, LARGEST_BUNDLE)
    except zlib.error:
        return b""
