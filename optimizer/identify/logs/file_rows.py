"""Rows of a CSV file of a log as arrays, some thousand lines at a time."""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedIOBase, BufferedReader, BytesIO
from itertools import islice
from pathlib import Path
from zlib import error as ZlibError

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.csv_table import line_of, names_of, numbers_of, with_points, wrong_length
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.exceptions import InvalidTable
from joulepath.optimizer.identify.errors import LogTooLarge
from joulepath.optimizer.identify.logs.bag import PieceReader, bag_text, kind_of_bag
from joulepath.optimizer.identify.logs.head import HEAD, Head, is_comment

_GZIP_MAGIC = b"\x1f\x8b"


@dataclass(frozen=True)
class FileSettings:
    """Limits of the file of a log."""

    max_bytes: int = 1 << 30
    """Largest size after unpacking [bytes]."""
    head_bytes: int = 4096
    """Bytes by which the kind of a file is recognised."""
    max_dropped: float = 0.1
    """Largest share of lines with a wrong number of cells; more show that the whole file is
    wrong [1]."""


FILE = FileSettings()


class LogSource:
    """Lines of a log, unpacked if the file is gzip; those of a bag of ROS 2 are made of its
    messages.

    Args:
        source: path of the file, or its content.
        max_bytes: largest size after unpacking [bytes].
    """

    def __init__(self, source: Path | bytes, max_bytes: int = FILE.max_bytes) -> None:
        file = BytesIO(source) if isinstance(source, bytes) else source.open("rb", buffering=0)

        def read(size: int) -> bytes:
            checkpoint()  # gzip files may have millions of empty members
            return file.read(size)

        self._raw = BufferedReader(PieceReader(read, file.close))
        packed = self._raw.peek(2)[:2] == _GZIP_MAGIC
        self._file: BufferedIOBase = gzip.GzipFile(fileobj=self._raw) if packed else self._raw
        self._max_bytes, self._read, self._begun = max_bytes, 0, False

    def __enter__(self) -> LogSource:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        self._raw.close()

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read a line, as of a file.

        Raises:
            InvalidTable: the file is broken gzip.
            LogTooLarge: the file is too large.
        """
        try:
            if not self._begun:
                self._begin()
            line = self._file.readline(size)
        except (OSError, EOFError, ZlibError):
            raise InvalidTable(
                "The file is broken gzip: pack it again, or send it unpacked."
            ) from None
        self._read += len(line)
        if self._read > self._max_bytes:
            raise LogTooLarge(self._max_bytes, "bytes after unpacking")
        return line

    def _begin(self) -> None:
        """Find out what kind of file it is: a bag, or lines that end with carriage returns."""
        self._begun = True
        file = self._file if isinstance(self._file, BufferedReader) else BufferedReader(self._file)
        head = file.peek(FILE.head_bytes)[: FILE.head_bytes]
        kind = kind_of_bag(head)
        if kind is not None:
            self._file = BufferedReader(bag_text(file, kind, self._max_bytes))
        elif b"\r" in head and b"\n" not in head:
            self._file = BufferedReader(
                PieceReader(lambda size: file.read1(size).replace(b"\r", b"\n"))
            )
        else:
            self._file = file


class FileRows:
    """Rows of a file below its head.

    Lines with a wrong number of cells are dropped. Comments and repetitions of the header are not
    rows.

    Args:
        file: lines of the log.
        head: head that has been read from it.
    """

    def __init__(self, file: LogSource, head: Head) -> None:
        self.head = head
        self.dropped = 0
        self._file = file
        self._row, self._pushed = head.row, head.first
        self._first_dropped: InvalidTable | None = None

    def first(self) -> tuple[list[str], int]:
        """Cells of the next row, which will be read again, and the number of its line."""
        row, line = next(self._lines(), (self._row, ""))
        self._row, self._pushed = row, line or None
        return self._stripped(line).split(self.head.separator), row

    def skip(self) -> None:
        """Skip the row shown by `first`."""
        self._pushed = None
        self._row += 1

    def blocks(self, used: Sequence[int]) -> Iterator[tuple[Array, Array]]:
        """Blocks of rows.

        Args:
            used: indices of the columns to read.

        Yields:
            Numbers of the lines (k,), and values (k, used).

        Raises:
            InvalidTable: too many lines are dropped, or a cell is not a number.
            LogTooLarge: there are too many rows.
        """
        kept, head = 0, self.head
        while lines := [*islice(self._lines(), MOTION_LIMITS.block_rows)]:
            good, numbers = self._of_right_length(lines)
            kept += len(good)
            if kept + self.dropped > MOTION_LIMITS.max_rows:
                raise LogTooLarge(MOTION_LIMITS.max_rows, "rows")
            if good:
                points = good if head.separator == "," else [*with_points(good, numbers[0])]
                values = numbers_of(points, numbers, head.names, head.separator, used)
                yield np.array(numbers), values
        too_many = self.dropped > FILE.max_dropped * (kept + self.dropped)
        if too_many and self._first_dropped is not None:
            raise self._first_dropped
        if kept < 2:
            raise InvalidTable("The file has fewer than two rows of numbers: a log needs more.")

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Lines that are rows, with their numbers."""
        while line := self._next_line():
            self._row += 1
            if line.strip() and not is_comment(line):
                yield self._row - 1, line

    def _next_line(self) -> str:
        if self._pushed is None:
            return line_of(self._file, self._row, HEAD.max_line_bytes)
        line, self._pushed = self._pushed, None
        return line

    def _stripped(self, line: str) -> str:
        return " ".join(line.split()) if self.head.separator == " " else line.rstrip("\r\n")

    def _of_right_length(self, lines: list[tuple[int, str]]) -> tuple[list[str], list[int]]:
        """Lines with the right number of cells, and their numbers."""
        good, numbers, separator, width = [], [], self.head.separator, len(self.head.names)
        for row, line in lines:
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
        """Whether a line repeats the header, as in concatenated files."""
        begin = line[:1].strip("\"'")
        word = bool(begin) and not begin.isdigit() and begin not in "+-. "
        return word and names_of(line, self.head.separator)[0] == self.head.names
