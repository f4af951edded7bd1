"""Least duration of motions along a tool path with a bound on the TCP speed.

A motion along a course passes all of its points in order: at some time, the TCP is within 2 ε of a
given point, twice the position tolerance. One ε is the tolerance of the motion from the course. The
other ε accounts for parts of the course omitted by the motion; the certificate admits them within
the tolerance of the followed part. At both ends the TCP is exactly at the point. Between two points
at a distance c, the TCP therefore moves by at least c - 4 ε, by c - 2 ε if one point is an end, and
by c from end to end. The sum over any sequence of course points is a lower bound of the distance:
few points suffice for a straight line, more are better at bends. The ratio of the bound to the
largest speed is the least duration.
"""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.tool_path import TOOL_PATH

DIVISIONS = (1, 2, 4, 8, 16, 32)
"""Numbers of parts of each piece of the course for which the bound is computed."""


def least_tcp_distance(course: ToolCourse) -> float:
    """Lower bound [m] of the distance covered by the TCP on motions within the tolerance of a
    course.
    """
    ends = np.linalg.norm(np.diff(course.poses(np.array([0.0, 1.0]))[:, :3, 3], axis=0))
    best = float(ends)
    for count in DIVISIONS:
        points = course.poses(course.grid(count))[:, :3, 3]
        slack = np.full(len(points), 2 * course.path.position_tolerance)
        slack[[0, -1]] = 0.0
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1) - slack[1:] - slack[:-1]
        best = max(best, float(np.maximum(apart, 0.0).sum()))
    return best


def least_time(arm: Arm, course: ToolCourse) -> float:
    """Least duration [s] of motions along a course; zero without a speed limit of the TCP."""
    fixed = course.path.fixed_speed
    most = np.inf if arm.tcp_speed is None else arm.tcp_speed
    if fixed is not None:
        most = min(most, fixed * (1 + TOOL_PATH.speed_tolerance))
    return least_tcp_distance(course) / (most * (1 + RATIO_TOLERANCE)) if np.isfinite(most) else 0.0
