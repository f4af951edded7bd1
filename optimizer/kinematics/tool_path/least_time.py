"""The least time in which the TCP goes along a tool path whose speed has a bound.

A motion along a course passes by each of its points, in their order: for each point there is a time
at which the TCP is within twice the position tolerance of it. (Once for how far the motion may be
from the course, and once for what the certificate lets it leave out of the course, which lies
within the tolerance of what it goes along.) At both ends it is at the very point. So between the
times of two points, c apart, the TCP moves by c - 4 ε at least, or c - 2 ε where one of them is an
end, or c from end to end. The sum over any points of the course is the least way of the TCP: few
points for a straight line, more where it bends. This over the greatest speed is the least time.
"""

from __future__ import annotations

import numpy as np

from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.tool_path import SPEED_TOLERANCE

# pieces into which the course is divided, its corners kept
PIECES = (1, 2, 4, 8, 16, 32)


def least_way(course: ToolCourse) -> float:
    """What the TCP moves by at least [m] on motions along a course within its tolerance."""
    ends = np.linalg.norm(np.diff(course.poses(np.array([0.0, 1.0]))[:, :3, 3], axis=0))
    best = float(ends)
    for count in PIECES:
        points = course.poses(course.grid(count))[:, :3, 3]
        missed = np.full(len(points), 2 * course.path.position_tolerance)
        missed[[0, -1]] = 0.0
        apart = np.linalg.norm(np.diff(points, axis=0), axis=1) - missed[1:] - missed[:-1]
        best = max(best, float(np.maximum(apart, 0.0).sum()))
    return best


def least_time(arm: Arm, course: ToolCourse) -> float:
    """Least duration [s] of motions along a course; zero where no speed of the TCP is given."""
    fixed = course.path.fixed_speed
    most = np.inf if arm.tcp_speed is None else arm.tcp_speed
    if fixed is not None:
        most = min(most, fixed * (1 + SPEED_TOLERANCE))
    return least_way(course) / (most * (1 + RATIO_TOLERANCE)) if np.isfinite(most) else 0.0
