"""`npz`: arrays for NumPy, samples and the splines they come from."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np

from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.export.rows import TableOptions, times


def to_npz(program: Program, options: TableOptions | None = None) -> WrittenFile:
    """Arrays t (k,) [s], q, v, a (k, nq) [rad, s] every period, `joint_names`, `speed_scale`, and
    for the move of index i `degree_i`, `knots_i` (m,) [s], `control_points_i` (n, nq) [rad] and its
    start `t0_i` [s].

    `numpy.load` reads it without pickle. Raises FormatUnsuitable if the motion is too long.
    """
    t = times(program, (options or TableOptions()).period, "npz")
    q, v, a = program.at(t)
    begins = [timed.t0 for timed in program.timed if isinstance(timed.step, Move)]
    splines: dict[str, Any] = {
        f"{name}_{i}": value
        for i, (move, t0) in enumerate(zip(program.moves, begins, strict=True))
        for name, value in (
            ("degree", move.spline.degree),
            ("knots", move.spline.knots),
            ("control_points", move.spline.control_points),
            ("t0", t0),
        )
    }
    file = BytesIO()
    names = np.array(program.robot.joint_names)
    np.savez_compressed(
        file, t=t, q=q, v=v, a=a, joint_names=names, speed_scale=program.speed_scale, **splines
    )
    return WrittenFile(file.getvalue(), "application/octet-stream", "npz")
