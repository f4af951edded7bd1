"""`csv`: samples of positions, velocities and accelerations in the format of `POST /evaluate`."""

from __future__ import annotations

from collections.abc import Mapping
from io import StringIO

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.export.rows import TableOptions, times


def to_csv(program: Program, options: TableOptions | None = None) -> WrittenFile:
    """Write a program as CSV, with columns t, q1 …, v1 …, a1 … [s, rad] and one row per period.

    Args:
        program: the motion.
        options: period of the rows; None for the defaults.

    Raises:
        FormatUnsuitable: the motion is too long.
    """
    period = (options or TableOptions()).period
    t = times(program, period, "csv")
    text = csv_text(t, dict(zip("qva", program.at(t), strict=True)), "%.12g")
    notes = (f"Rows every {period:g} s, exact at each row; the reader interpolates between them.",)
    return WrittenFile.of_text(text, "text/csv", "csv", notes)


def csv_text(t: Array, columns: Mapping[str, Array], form: str | list[str]) -> str:
    """A table of times t (n,) [s] and of columns (n, nq), named by their letter and the joint's
    number from 1; `form` is the format of the numbers, or of those of each column.
    """
    joints = [
        f"{kind}{joint}" for kind, of in columns.items() for joint in range(1, of.shape[1] + 1)
    ]
    text, table = StringIO(), np.column_stack([t, *columns.values()])
    head = ",".join(["t", *joints])
    np.savetxt(text, table, fmt=form, delimiter=",", header=head, comments="")
    return text.getvalue()
