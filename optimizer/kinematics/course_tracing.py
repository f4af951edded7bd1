"""From the course of the TCP to that of the joints: inverse kinematics by Newton's method, each point from the last.

Several configurations of the first pose are followed at once. Each leads along one curve in joint space, as far as the
arm reaches and no singularity stops it. The joint path is a quintic spline through what was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from models.robot import Array, Robot
from optimizer.deadline import checkpoint
from optimizer.kinematics import newton
from optimizer.kinematics.chain import Chain
from optimizer.kinematics.tcp import flange_pose, tcp_pose
from optimizer.kinematics.tool_course import ToolCourse
from optimizer.problem.arm import Arm
from optimizer.trajectories import bspline
from optimizer.trajectories.spline import Spline

# way [m] from point to point, and how many there are at least on a straight line, and on each part of a course with
# corners
STEP, ON_LINE, AT_CORNERS = 0.005, 32, 160
# joints that move farther from point to point [rad] are followed in so many times as many steps
FAR, FINER = 0.03, 4
# a configuration is on the course if it misses the pose by less [m, rad]
REACHED = 1e-9
# a joint that turns farther from one point to the next [rad] does so at a singularity
JUMP = 0.25
# control points of the joint path that are tried, and the share of the tolerances that its fit may take
CONTROL_POINTS, SHARE = (12, 20, 36, 60, 100, 160), 0.1
# points per step at which the fit is checked
CHECKED = 2

Obstacle = Literal["unreachable", "singular"]


@dataclass(frozen=True, eq=False)
class Trace:
    """Configurations q (m, nq) [rad] at the first fractions of a course, and why they end before its end, if so."""

    q: Array
    followed: float
    obstacle: Obstacle | None = None


@lru_cache(maxsize=16)
def _chain_of(robot: Robot) -> Chain:
    return Chain.of(robot.model)


def traces(arm: Arm, course: ToolCourse, q_start: Array) -> list[Trace]:
    """The course followed from each configuration q_start (n, nq) [rad] of its first pose.

    Where joints move far from point to point, it is followed once more with more points.
    """
    parts = len(course.shift)
    steps = max(int(np.ceil(course.length / STEP)), ON_LINE if parts == 1 else AT_CORNERS * parts)
    found = _traced(arm, course, q_start, steps)
    coarse = [k for k, each in enumerate(found) if len(each.q) > 1 and np.abs(np.diff(each.q, axis=0)).max() > FAR]
    if coarse:
        finer = _traced(arm, course, q_start[coarse], FINER * steps)
        found = [finer[coarse.index(k)] if k in coarse else each for k, each in enumerate(found)]
    return found


def _traced(arm: Arm, course: ToolCourse, q_start: Array, steps: int) -> list[Trace]:
    fractions = np.linspace(0.0, 1.0, steps + 1)
    poses, chain = course.poses(fractions), _chain_of(arm.robot)
    q = np.full((len(q_start), steps + 1, q_start.shape[1]), np.nan)
    q[:, 0] = q_start
    last, obstacle = np.zeros(len(q_start), dtype=int), list[Obstacle | None]([None] * len(q_start))
    going = np.arange(len(q_start))
    for k in range(1, steps + 1):
        checkpoint()
        before = q[going, k - 1]
        guess = before if k == 1 else 2 * before - q[going, k - 2]
        found, missed = newton.solved(chain, guess, flange_pose(poses[k], arm.T_flange_tcp))
        jumped = np.abs(found - before).max(axis=1) > JUMP
        for node, is_missed, is_jump in zip(going, missed > REACHED, jumped, strict=True):
            if is_missed or is_jump:
                obstacle[node] = "unreachable" if is_missed else "singular"
        kept = ~(jumped | (missed > REACHED))
        going = going[kept]
        if not len(going):
            break
        q[going, k], last[going] = found[kept], k
    return [Trace(q[n, : last[n] + 1], float(fractions[last[n]]), obstacle[n]) for n in range(len(q_start))]


def joint_path(arm: Arm, course: ToolCourse, trace: Trace) -> Spline | None:
    """The path γ(s), s ∈ [0, 1], through a whole trace; None if it turns too sharply for the tolerances."""
    fractions = np.linspace(0.0, 1.0, len(trace.q))
    checked = np.linspace(0.0, 1.0, CHECKED * len(trace.q))
    for count in CONTROL_POINTS:
        if count > len(trace.q):
            break
        knots = bspline.uniform(count).knots
        matrix = bspline.basis_matrix(knots, fractions)
        points = np.zeros((count, trace.q.shape[1]))
        points[0], points[-1] = trace.q[0], trace.q[-1]
        points[1:-1] = np.linalg.lstsq(matrix[:, 1:-1], trace.q - matrix @ points, rcond=None)[0]
        path = Spline(bspline.DEGREE, knots, points)
        if max(path_ratios(arm, course, path.curve(checked)).values()) <= SHARE:
            return path
    return None


def path_ratios(arm: Arm, course: ToolCourse, q: Array) -> dict[str, float]:
    """The worst deviations of configurations q (k, nq) [rad] from a course, over their tolerances."""
    position, rotation = course.deviation(tcp_pose(arm, q))
    return {
        "path_position": float(position.max()) / course.path.position_tolerance,
        "path_rotation": float(rotation.max()) / course.path.rotation_tolerance,
    }


def within(trace: Trace, lower: Array, upper: Array) -> bool:
    """Whether a trace keeps within joint limits (nq,) [rad]."""
    return bool(((trace.q >= lower) & (trace.q <= upper)).all())


def turned(trace: Trace, lower: Array, upper: Array, choices: Sequence[Sequence[float]]) -> Trace | None:
    """The trace by full turns of its joints within joint limits (nq,) [rad], nearest to their middle.

    `choices` are the positions of each joint at its start. None if no full turns are.
    """
    shift = np.zeros(len(lower))
    for joint, positions in enumerate(choices):
        course, found = trace.q[:, joint], list[tuple[float, float]]()
        for position in positions:
            offset = position - course[0]
            low, high = course.min() + offset, course.max() + offset
            if lower[joint] <= low and high <= upper[joint]:
                found.append((abs((low + high) - (lower[joint] + upper[joint])), offset))
        if not found:
            return None
        shift[joint] = min(found)[1]
    return Trace(trace.q + shift, trace.followed, trace.obstacle)
