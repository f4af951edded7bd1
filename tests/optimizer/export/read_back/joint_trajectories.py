"""The motion made from a message by the joint trajectory controller of ros2_control."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import BPoly

from joulepath.optimizer.export.program import Program

POINT = {"positions", "velocities", "accelerations", "effort", "time_from_start"}


def followed(trajectory: dict[str, Any]) -> BPoly:
    """The controller's interpolation: the quintic through position, velocity and acceleration at
    both ends of a segment.

    SciPy builds it from the Bernstein basis, independent of the library's formula.
    """
    assert trajectory.keys() <= {"header", "joint_names", "points"}
    points = trajectory["points"]
    assert all(point.keys() <= POINT for point in points)
    times = [point["time_from_start"] for point in points]
    assert all(0 <= each["nanosec"] < 1_000_000_000 for each in times)
    t = np.array([each["sec"] + each["nanosec"] * 1e-9 for each in times])
    assert t[0] == 0 and (np.diff(t) > 0).all()
    states = [
        [point[name] for name in ("positions", "velocities", "accelerations")] for point in points
    ]
    return BPoly.from_derivatives(t, np.array(states))


def deviations(program: Program, curve: BPoly) -> tuple[float, float]:
    """The largest deviations [rad], [rad/s] of a course from the program."""
    t = np.linspace(0, program.duration, 20_011)
    q, v, _ = program.at(t)
    end = np.minimum(t, curve.x[-1])
    return float(np.abs(curve(end) - q).max()), float(np.abs(curve(end, 1) - v).max())
