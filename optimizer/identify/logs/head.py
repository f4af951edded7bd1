"""Head of the table of a log: comments, header and an optional line of units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from joulepath.optimizer.csv_table import SEPARATORS, Lines, line_of, names_of
from joulepath.optimizer.exceptions import InvalidTable

_COMMENT = ("#", "//", "%")
_ROS_HEADER = "%time"
"""First column of ROS, which is no comment."""
_SEPARATOR_LINE = re.compile(r"sep=(.)")
"""Line of spreadsheets that names the separator."""
_STAMP = ("sec", "nanosec", "frame_id")
NUMBERED = "column {}"
"""Name of a column without header, by its number from 1."""


@dataclass(frozen=True)
class HeadSettings:
    """Limits of the head of a log."""

    max_line_bytes: int = 16384
    """Largest length of a line; a full RTDE record has nearly 200 columns."""
    max_lines: int = 100
    """Largest number of lines above the header."""


HEAD = HeadSettings()


@dataclass(frozen=True)
class Head:
    """Header of a table."""

    names: list[str]
    """Names of the columns, in lower case."""
    separator: str
    row: int
    """Number of the first line below the header."""
    first: str | None = None
    """That line, if it has been read already."""


def head_of(file: Lines) -> Head:
    """Read the head of a log.

    Comments, a line with the separator, and empty lines may stand above the header. The header may
    be the last of the comments. A JointState without header, as printed by `ros2 topic echo --csv`,
    gets a header; the columns of other files without header are named by their numbers.

    Args:
        file: lines of the log.

    Raises:
        InvalidTable: there is no header.
    """
    comment, separators = "", SEPARATORS + " "
    for row in count(1):
        line = line_of(file, row, HEAD.max_line_bytes)
        if not line or row > HEAD.max_lines:
            where = (
                "The file is empty" if row == 1 else f"There is no header in the first {row} lines"
            )
            raise InvalidTable(
                f"{where}: send a header and two or more rows.", None if row == 1 else row
            )
        text = line.removeprefix("\ufeff").strip() if row == 1 else line.strip()
        said = _SEPARATOR_LINE.fullmatch(text.strip('"'))
        if said:
            separators = said[1]
        elif is_comment(text):
            comment = text
        elif text:
            break
    names, separator = names_of(text, separators)
    if all(is_number(each) for each in names):
        if comment:
            names, separator = names_of(comment.lstrip("#/% "), separators)
        else:
            names = [NUMBERED.format(k) for k in range(1, len(names) + 1)]
        return Head(names, separator, row, line)
    state = _joint_state(names)
    if state is not None:
        return Head(state, separator, row, line)
    while names and not names[-1]:
        names.pop()
    return Head(names, separator, row + 1)


def is_comment(line: str) -> bool:
    """Whether a line is a comment and no row."""
    text = line.lstrip()
    return text.startswith(_COMMENT) and not text.lower().startswith(_ROS_HEADER)


def is_number(cell: str) -> bool:
    """Whether a cell contains a number."""
    try:
        float(cell.strip().strip('"'))
    except ValueError:
        return False
    return True


def _joint_state(cells: Sequence[str]) -> list[str] | None:
    """Header for rows of a JointState: seconds, nanoseconds, frame, names, and as many positions,
    velocities and efforts; None for cells of another kind.
    """
    if len(cells) < len(_STAMP) or not (is_number(cells[0]) and is_number(cells[1])):
        return None
    behind = cells[len(_STAMP) :]
    names = behind[: next((k for k, cell in enumerate(behind) if is_number(cell)), len(behind))]
    kinds, rest = divmod(len(behind) - len(names), max(len(names), 1))
    if rest or not 1 <= kinds <= 3 or not all(map(is_number, behind[len(names) :])):
        return None
    values = [
        f"{name}/{kind}" for kind in ("position", "velocity", "effort")[:kinds] for name in names
    ]
    return [*_STAMP, *(f"name{k}" for k in range(len(names))), *values]
