"""Rows of a log's CSV file as arrays, some thousand lines at a time. Lines of a wrong length are
dropped.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedIOBase, BufferedReader, BytesIO, RawIOBase
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO
from zlib import error as ZlibError

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.csv_table import line_of, names_of, numbers_of, with_points, wrong_length
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.evaluate.recording import BLOCK, MOST_ROWS
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.logs.head import LONGEST_LINE, Head, is_comment
from joulepath.optimizer.identify.logs.log_errors import LogTooLarge

MOST_BYTES = 1 << 30
"""Most bytes of a log after unpacking, if the caller does not allow fewer."""
MOST_DROPPED = 0.1
"""Greatest fraction of lines with a wrong number of cells: beyond it, something is wrong with the
file as a whole.
"""
_GZIP = b"\x1f\x8b"


class _Watched(RawIOBase):
    """A file whose every reading looks at the watched deadline: gzip may have millions of members
    with nothing in them."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def readable(self) -> bool:
        """It is."""
        return True

    def readinto(self, buffer: Any, /) -> int:
        """As of a file. Raises DeadlinePassed."""
        checkpoint()
        view = memoryview(buffer)
        data = self._file.read(len(view))
        view[: len(data)] = data
        return len(data)

    def close(self) -> None:
        """Closes the file, too."""
        self._file.close()
        super().close()


class Source:
    """The bytes of a log, unpacked if they are gzip, at most `most` of them. Raises LogTooLarge,
    InvalidTable.
    """

    def __init__(self, source: Path | bytes, most: int = MOST_BYTES) -> None:
        raw = BufferedReader(
            _Watched(
                BytesIO(source) if isinstance(source, bytes) else source.open("rb", buffering=0)
            )
        )
        self._raw = raw
        packed = raw.peek(2)[:2] == _GZIP
        self._file: BufferedIOBase = gzip.GzipFile(fileobj=raw) if packed else raw
        self._most, self._read = most, 0

    def __enter__(self) -> Source:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._raw.close()

    def readline(self, size: int | None = -1, /) -> bytes:
        """As of a file."""
        try:
            line = self._file.readline(size)
        except (OSError, EOFError, ZlibError):
            raise InvalidTable(
                "The file is broken gzip: pack it anew, or send it unpacked."
            ) from None
        self._read += len(line)
        if self._read > self._most:
            raise LogTooLarge(self._most, "bytes after unpacking")
        return line


@dataclass
class Rows:
    """The rows of a file below its head: `blocks` yields (line numbers, values (k, used)).

    `dropped` counts, while the blocks are read, lines with too few or too many cells. Comments and
    repetitions of the header are no rows.
    """

    file: Source
    head: Head
    used: Sequence[int]
    dropped: int = 0
    _first_dropped: InvalidTable | None = None

    def __post_init__(self) -> None:
        self._row, self._pushed = self.head.row, self.head.first

    def first(self) -> tuple[list[str], int]:
        """The cells of the next row, which is read again by whatever comes next, and its line."""
        row, line = next(self._lines(), (self._row, ""))
        self._push(row, line)
        return self._stripped(line).split(self.head.separator), row

    def skip(self) -> None:
        """Leaves out the row that `first` has shown."""
        self._pushed = None
        self._row += 1

    def blocks(self) -> Iterator[tuple[Array, Array]]:
        """Blocks of rows. Raises InvalidTable or LogTooLarge."""
        kept = 0
        while found := [*islice(self._lines(), BLOCK)]:
            good, numbers = self._of_right_length(found)
            kept += len(good)
            if kept + self.dropped > MOST_ROWS:
                raise LogTooLarge(MOST_ROWS, "rows")
            if good:
                points = good if self.head.separator == "," else [*with_points(good, numbers[0])]
                values = numbers_of(
                    points, numbers, self.head.names, self.head.separator, self.used
                )
                yield np.array(numbers), values
        if self.dropped > MOST_DROPPED * (kept + self.dropped) and self._first_dropped is not None:
            raise self._first_dropped
        if kept < 2:
            raise InvalidTable("The file has fewer than two rows of numbers: a log needs more.")

    def _push(self, row: int, line: str) -> None:
        self._row, self._pushed = row, line or None

    def _lines(self) -> Iterator[tuple[int, str]]:
        """The lines that are rows, with their numbers."""
        while line := self._next_line():
            self._row += 1
            if line.strip() and not is_comment(line):
                yield self._row - 1, line

    def _next_line(self) -> str:
        if self._pushed is None:
            return line_of(self.file, self._row, LONGEST_LINE)
        line, self._pushed = self._pushed, None
        return line

    def _stripped(self, line: str) -> str:
        return " ".join(line.split()) if self.head.separator == " " else line.rstrip("\r\n")

    def _of_right_length(self, found: list[tuple[int, str]]) -> tuple[list[str], list[int]]:
        good, numbers, separator, width = [], [], self.head.separator, len(self.head.names)
        for row, line in found:
            stripped = self._stripped(line)
            cells = stripped.count(separator) + 1
            while cells > width and stripped.endswith(separator):
                stripped, cells = stripped.removesuffix(separator), cells - 1
            if cells == width:
                if self._is_header(stripped):
                    continue
                good.append(stripped)
                numbers.append(row)
            else:
                self.dropped += 1
                if self._first_dropped is None:
                    self._first_dropped = wrong_length(line, row, cells, width, separator)
        return good, numbers

    def _is_header(self, line: str) -> bool:
        """Whether a line is the header again, as where files were joined."""
        begin = line[:1].strip("\"'")
        return (
            bool(begin) and not begin.isdigit() and begin not in "+-. " and self._same_names(line)
        )

    def _same_names(self, line: str) -> bool:
        return names_of(line, self.head.separator)[0] == self.head.names
