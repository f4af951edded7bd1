"""Where the table of a log begins: behind comments, with a header, and perhaps with a line of
units.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from joulepath.optimizer.csv_table import SEPARATORS, Lines, line_of, names_of
from joulepath.optimizer.exceptions import InvalidTable

LONGEST_LINE = 16384
"""Most bytes of a line: a full RTDE record has nearly 200 columns."""
MOST_LINES = 100
"""Lines above the header at most."""
_COMMENT = ("#", "//", "%")
_HEADER = "%time"  # of ROS, which is no comment
_SEPARATOR = re.compile(r"sep=(.)")  # of spreadsheets
_STAMP = ("sec", "nanosec", "frame_id")


@dataclass(frozen=True)
class Head:
    """Names of the columns, in lower case, and what separates them. `row` is the number of the
    first line behind the header, which has been read already if it is `first`."""

    names: list[str]
    separator: str
    row: int
    first: str | None = None


def head_of(file: Lines, joints: Sequence[str]) -> Head:
    """The head of the log of an arm with these joints. Raises InvalidTable.

    Lines of comments, of a spreadsheet's separator, and empty ones may stand above the header. A
    header may be the last of the comments. A JointState without a header, as `ros2 topic echo
    --csv` prints it, gets one.
    """
    comment, separators = "", SEPARATORS + " "
    for row in count(1):
        line = line_of(file, row, LONGEST_LINE)
        if not line or row > MOST_LINES:
            where = (
                "The file is empty" if row == 1 else f"There is no header in the first {row} lines"
            )
            raise InvalidTable(
                f"{where}: send a header and two or more rows.", None if row == 1 else row
            )
        text = line.removeprefix("\ufeff").strip() if row == 1 else line.strip()
        said = _SEPARATOR.fullmatch(text.strip('"'))
        if said:
            separators = said[1]
        elif is_comment(text):
            comment = text
        elif text:
            break
    names, separator = names_of(text, separators)
    if all(number(each) for each in names):
        if comment:
            names, separator = names_of(comment.lstrip("#/% "), separators)
        return Head(names, separator, row, line)
    state = _joint_state(names, [joint.lower() for joint in joints])
    if state is not None:
        return Head(state, separator, row, line)
    while names and not names[-1]:
        names.pop()
    return Head(names, separator, row + 1)


def is_comment(line: str) -> bool:
    """Whether a line is no row, but a remark."""
    text = line.lstrip()
    return text.startswith(_COMMENT) and not text.lower().startswith(_HEADER)


def number(cell: str) -> bool:
    """Whether a cell has a number."""
    try:
        float(cell.strip().strip('"'))
    except ValueError:
        return False
    return True


def _joint_state(cells: Sequence[str], joints: Sequence[str]) -> list[str] | None:
    """The header of rows of a JointState: seconds, nanoseconds, frame, names, and as many
    positions, velocities and efforts; None if these cells are none."""
    if (
        len(cells) < len(_STAMP)
        or not (number(cells[0]) and number(cells[1]))
        or not set(joints) <= set(cells)
    ):
        return None
    behind = cells[len(_STAMP) :]
    names = behind[: next((k for k, cell in enumerate(behind) if number(cell)), len(behind))]
    kinds, rest = divmod(len(behind) - len(names), max(len(names), 1))
    if rest or not 1 <= kinds <= 3:
        return None
    values = [
        f"{name}/{kind}" for kind in ("position", "velocity", "effort")[:kinds] for name in names
    ]
    return [*_STAMP, *(f"name{k}" for k in range(len(names))), *values]
