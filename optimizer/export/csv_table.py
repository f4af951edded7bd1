"""`csv`: samples of positions, velocities and accelerations in the format of `POST /evaluate`."""

from __future__ import annotations

from io import StringIO

import numpy as np

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
    names = ["t", *(f"{kind}{joint}" for kind in "qva" for joint in range(1, program.robot.nq + 1))]
    text = StringIO()
    text.write(",".join(names) + "\n")
    np.savetxt(text, np.column_stack([t, *program.at(t)]), fmt="%.12g", delimiter=",")
    notes = (
        f"Rows every {period:g} s, exact at each; between them it is for the reader to "
        "interpolate.",
    )
    return WrittenFile.of_text(text.getvalue(), "text/csv", "csv", notes)
