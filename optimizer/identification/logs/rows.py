"""Rows of a log's CSV file as arrays, some thousand lines at a time. Lines of a wrong length are dropped."""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedIOBase, BufferedReader, BytesIO
from itertools import islice
from pathlib import Path
from typing import cast
from zlib import error as ZlibError

import numpy as np

from models.robot import Array
from optimizer.csv_table import FIRST_ROW, line_of, numbers_of, with_points, wrong_length
from optimizer.exceptions import InvalidTable
from optimizer.identification.logs.log_errors import LogTooLarge
from optimizer.replay.recording import BLOCK, MOST_ROWS

LONGEST_LINE = 16384
"""Most bytes of a line: a full RTDE record has nearly 200 columns."""
MOST_BYTES = 1 << 30
"""Most bytes of a log after unpacking, if the caller does not allow fewer."""
MOST_DROPPED = 0.1
"""Greatest fraction of lines with a wrong number of cells: beyond it, something is wrong with the file as a whole."""
_GZIP = b"\x1f\x8b"


class Source:
    """The bytes of a log, unpacked if they are gzip, at most `most` of them. Raises LogTooLarge, InvalidTable."""

    def __init__(self, source: Path | bytes, most: int = MOST_BYTES) -> None:
        raw = BufferedReader(cast(BufferedReader, BytesIO(source))) if isinstance(source, bytes) else source.open("rb")
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
            raise InvalidTable("The file is broken gzip: pack it anew, or send it unpacked.") from None
        self._read += len(line)
        if self._read > self._most:
            raise LogTooLarge(self._most, "bytes after unpacking")
        return line


@dataclass
class Rows:
    """The rows of a file after its header: `blocks` yields (line numbers, values (k, used)).

    `dropped` counts, while the blocks are read, lines with too few or too many cells.
    """

    file: Source
    columns: list[str]
    separator: str
    used: Sequence[int]
    dropped: int = 0
    _first_dropped: InvalidTable | None = None
    _first: str | None = None

    def first(self) -> list[str]:
        """The cells of the first row; fewer if the line is short."""
        self._first = line_of(self.file, FIRST_ROW, LONGEST_LINE)
        stripped = self._first.strip() if self.separator == " " else self._first.rstrip("\r\n")
        return stripped.split(self.separator)

    def blocks(self) -> Iterator[tuple[Array, Array]]:
        """Blocks of rows. Raises InvalidTable or LogTooLarge."""
        row, kept = FIRST_ROW, 0
        while lines := [*islice(self._lines(row), BLOCK)]:
            rows = range(row, row + len(lines))
            row += len(lines)
            if row - FIRST_ROW > MOST_ROWS:
                raise LogTooLarge(MOST_ROWS, "rows")
            good, numbers = self._of_right_length(lines, rows)
            if good:
                kept += len(good)
                points = good if self.separator == "," else [*with_points(good, numbers[0])]
                yield np.array(numbers), numbers_of(points, numbers, self.columns, self.separator, self.used)
        if self.dropped > MOST_DROPPED * (kept + self.dropped) and self._first_dropped is not None:
            raise self._first_dropped
        if kept < 2:
            raise InvalidTable("The file has fewer than two rows of numbers: a log needs more.")

    def _lines(self, row: int) -> Iterator[str]:
        if self._first:
            first, self._first = self._first, None
            yield first
            row += 1
        while line := line_of(self.file, row, LONGEST_LINE):
            yield line
            row += 1

    def _of_right_length(self, lines: list[str], rows: range) -> tuple[list[str], list[int]]:
        good, numbers = [], []
        for row, line in zip(rows, lines, strict=True):
            stripped = line.strip() if self.separator == " " else line.rstrip("\r\n")
            cells = stripped.count(self.separator) + 1
            if cells == len(self.columns):
                good.append(line)
                numbers.append(row)
            elif stripped.strip():  # an empty line is no row
                self.dropped += 1
                if self._first_dropped is None:
                    self._first_dropped = wrong_length(line, row, cells, len(self.columns), self.separator)
        return good, numbers
