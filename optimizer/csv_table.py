"""Lines and numbers of a CSV file, for motions and logs. Errors name line and column."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidTable

FIRST_ROW = 2
"""Line number of the first row of numbers; the header is line 1."""
SEPARATORS = ",;\t"
_WORDS = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces"}


class Lines(Protocol):
    """Source of lines: a file, or a decompressor."""

    def readline(self, size: int | None = -1, /) -> bytes:
        """The next line, or its first `size` bytes."""


_SPREADSHEET = b"PK\x03\x04"


def line_of(file: Lines, row: int, longest: int) -> str:
    """The next line of a file; empty at its end.

    Args:
        file: the file.
        row: number of the line, for errors.
        longest: greatest number of characters.

    Raises:
        InvalidTable: the line is too long, binary, or no UTF-8 text.
        DeadlinePassed: a watched deadline has passed.
    """
    checkpoint()
    raw = file.readline(longest + 1)
    if len(raw) > longest:
        raise InvalidTable(
            f"Line {row} is longer than {longest} characters: send one row per line.", row
        )
    if row == 1 and raw.startswith(_SPREADSHEET):
        raise InvalidTable("The file is a spreadsheet: export it as CSV.", row)
    if row == 1 and raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InvalidTable("The file is UTF-16: save it as CSV in UTF-8.", row)
    if b"\0" in raw:
        raise InvalidTable(f"Line {row} has binary data: send CSV as plain text.", row)
    try:
        return raw.decode()
    except UnicodeDecodeError:
        raise InvalidTable(f"Line {row} is not UTF-8 text: send CSV as plain text.", row) from None


def header_of(file: Lines, longest: int, separators: str = SEPARATORS) -> tuple[list[str], str]:
    """Names of the columns in the first line, and their separator; see `names_of`.

    Raises:
        InvalidTable: the file is empty or unreadable.
    """
    first = line_of(file, 1, longest)
    if not first:
        raise InvalidTable("The file is empty: send a header and two or more rows.")
    return names_of(first.removeprefix("\ufeff").strip(), separators)


def names_of(header: str, separators: str = SEPARATORS) -> tuple[list[str], str]:
    """Lower-case names of the columns of a header, and the separator.

    The separator is the most frequent of `separators`; a space counts only without any other.
    """
    separator = max(
        separators, key=lambda each: header.count(each) * (0.01 if each == " " else 1.0)
    )
    cells = header.split() if separator == " " else header.split(separator)
    return [name.strip().strip("\"'").strip().lower() for name in cells], separator


def with_points(lines: Sequence[str], first: int) -> Iterator[str]:
    """Lines with decimal points in place of decimal commas; `first` is the number of the first
    line.

    Raises:
        InvalidTable: a line has both commas and points.
    """
    for row, line in enumerate(lines, first):
        if "," not in line:
            yield line
        elif "." in line:
            raise InvalidTable(
                f"Line {row} has both commas and points in its numbers: use one of them as the "
                "decimal sign, and "
                "nothing between thousands.",
                row,
            )
        else:
            yield line.replace(",", ".")


def numbers_of(
    lines: Sequence[str],
    rows: Sequence[int],
    columns: list[str],
    separator: str,
    used: Sequence[int],
) -> Array:
    """Numbers of the used columns, shape (k, used).

    Without all columns in use, the caller checks that the lines have as many cells as the header.

    Args:
        lines: the lines.
        rows: their line numbers, for errors.
        columns: names of all columns.
        separator: separator of the columns.
        used: indices of the used columns.

    Raises:
        InvalidTable: a cell is no finite number, or a line has the wrong length.
    """
    # with a choice of columns, numpy accepts too long lines
    chosen = None if len(used) == len(columns) else used
    try:
        values = np.loadtxt(
            lines, delimiter=separator, comments=None, quotechar='"', ndmin=2, usecols=chosen
        )
    except ValueError:
        raise _first_error(lines, rows, columns, separator, used) from None
    if values.shape != (len(lines), len(used)) or not np.isfinite(values).all():
        raise _first_error(lines, rows, columns, separator, used)
    return np.asarray(values, dtype=float)


def _first_error(
    lines: Sequence[str],
    rows: Sequence[int],
    columns: list[str],
    separator: str,
    used: Sequence[int],
) -> InvalidTable:
    for row, line in zip(rows, lines, strict=True):
        cells = next(csv.reader([line], delimiter=separator), [])
        if len(cells) != len(columns):
            return wrong_length(line, row, len(cells), len(columns), separator)
        for k in used:
            try:
                finite = math.isfinite(float(cells[k])) and "_" not in cells[k]
            except ValueError:
                finite = False
            if not finite:
                name = columns[k]
                return InvalidTable(
                    f"{name} in line {row} is not a finite number: correct or delete it.", row, name
                )
    return InvalidTable(
        f"The lines from line {rows[0]} on cannot be read: write plain numbers.", rows[0]
    )


def wrong_length(line: str, row: int, cells: int, columns: int, separator: str) -> InvalidTable:
    """Error for a line with another number of cells than the header."""
    message = f"Line {row} has {cells} columns, but the header has {columns}: correct the line."
    # numbers without a fraction have no decimal comma
    if separator == "," and 1.5 * columns < cells <= 2 * columns:
        message += (
            " For numbers with a decimal comma, separate the columns by semicolons, also "
            "in the header."
        )
    elif any(other in line for other in SEPARATORS.replace(separator, "")):
        message += (
            f" The header separates the columns by {_WORDS[separator]}: use the same separator in "
            "every line."
        )
    return InvalidTable(message, row)
