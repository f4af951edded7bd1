"""`npz`: arrays for NumPy, with samples and splines."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np

from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.export.rows import TableOptions, times


def to_npz(program: Program, options: TableOptions | None = None) -> WrittenFile:
    """Write a program as arrays, to be read by `numpy.load` without pickle.

    The arrays are t (k,) [s] and q, v, a (k, nq) [rad, s] at every period, `joint_names`,
    `speed_scale`; and for the move with the index i, `degree_i`, `knots_i` (m,) [s],
    `control_points_i` (n, nq) [rad] and its start `t0_i` [s].

    Args:
        program: the motion.
        options: period of the samples; None for the defaults.

    Raises:
        FormatUnsuitable: the motion is too long.
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
