"""Reads a motion from a CSV file, a few thousand lines at a time. Errors name row and column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedReader
from itertools import islice
from math import pi
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.csv_table import FIRST_ROW, header_of, line_of, numbers_of, with_points
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS, RecordedRows
from joulepath.optimizer.exceptions import InvalidTable

LONGEST_LINE = 4096
_COLUMN = re.compile(r"t|[qva][1-9][0-9]?")
_NUMBER = re.compile(r'"?[-+]?[0-9.]')


@dataclass(frozen=True)
class MotionCsv:
    """A CSV file after its header: columns t, q1 … qn, then v1 … vn, then a1 … an; or q1 … qn
    alone.

    The header determines the separator: a comma, a semicolon or a tab. With the latter two, numbers
    may have a decimal comma.

    `rows` are the unread lines in blocks (k, columns) in the units of the file.
    `scale` converts joint columns to rad, rad/s, rad/s².
    """

    nq: int
    columns: list[str]
    scale: float
    rows: Iterator[Array]

    @property
    def has_time(self) -> bool:
        """Whether the file is a log. Otherwise it lists configurations."""
        return self.columns[0] == "t"

    @staticmethod
    def of(file: BufferedReader, nq: int, units: Literal["rad", "deg"]) -> MotionCsv:
        """Reads the header of a file for an arm with nq joints. Raises InvalidTable, now or when
        rows are read.
        """
        columns, separator = header_of(file, LONGEST_LINE)
        _check_header(columns, nq)
        return MotionCsv(
            nq, columns, pi / 180 if units == "deg" else 1.0, _blocks(file, columns, separator)
        )

    def log(self) -> Iterator[RecordedRows]:
        """The rows of a log, in s, rad, rad/s, rad/s²."""
        for block in self.rows:
            parts: list[Array | None] = [
                block[:, i : i + self.nq] * self.scale if i < len(self.columns) else None
                for i in range(1, 1 + 3 * self.nq, self.nq)
            ]
            assert parts[0] is not None
            yield RecordedRows(block[:, 0], parts[0], *parts[1:])

    def configurations(self) -> Array:
        """All configurations (n, nq) [rad]."""
        rows = [*self.rows]
        if sum(len(block) for block in rows) < 2:
            raise InvalidTable("The file has fewer than two rows: a motion needs two or more.")
        return np.concatenate(rows) * self.scale


def _check_header(columns: list[str], nq: int) -> None:
    groups = {kind: [f"{kind}{j}" for j in range(1, nq + 1)] for kind in "qva"}
    q, v, a = groups["q"], groups["v"], groups["a"]
    if columns in (q, ["t", *q], ["t", *q, *v], ["t", *q, *v, *a]):
        return
    wanted = (
        f"t,q1,…,q{nq}, then v1,…,v{nq} and a1,…,a{nq} if they were logged, or q1,…,q{nq} alone"
    )
    wanted += (
        ", or those of a log as POST /logs takes it. Separate columns by commas, semicolons or "
        "tabs."
    )
    if all(_NUMBER.match(name) for name in columns):
        raise InvalidTable(
            "The first line has numbers: put a header with the names of the columns first, "
            f"{wanted}",
            1,
        )
    if not any(_COLUMN.fullmatch(name) for name in columns):
        raise InvalidTable(
            "The first line is not a header: begin the file with the names of the columns, "
            f"{wanted}",
            1,
        )
    expected = q if columns[0] in q else ["t", *q, *v, *a]
    for k, (name, right) in enumerate(zip(columns, expected, strict=False), 1):
        if name != right:
            raise InvalidTable(
                f"Column {k} of the header is not `{right}`: its columns must be {wanted}", 1, right
            )
    last = columns[-1]
    raise InvalidTable(
        f"The header has {len(columns)} columns, up to `{last}`: they must be {wanted}", 1, last
    )


def _blocks(file: BufferedReader, columns: list[str], separator: str) -> Iterator[Array]:
    row = FIRST_ROW
    while lines := [*islice(_lines(file, row), MOTION_LIMITS.block_rows)]:
        if separator != ",":
            lines = [*with_points(lines, row)]
        yield numbers_of(
            lines, range(row, row + len(lines)), columns, separator, range(len(columns))
        )
        row += len(lines)
        if len(lines) < MOTION_LIMITS.block_rows:
            return


def _lines(file: BufferedReader, row: int) -> Iterator[str]:
    """All lines of the file, without empty ones at the end."""
    while line := line_of(file, row, LONGEST_LINE):
        if not line.strip():
            while rest := line_of(file, row, LONGEST_LINE):
                if rest.strip():
                    raise InvalidTable(f"Line {row} is empty: delete it.", row)
            return
        yield line
        row += 1
