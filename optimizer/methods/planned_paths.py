"""Planned collision-free paths of a candidate, and smooth paths along them with proven clearance."""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.collision.path_planner import length, lengths
from optimizer.deadline import Deadline
from optimizer.prepared_problem import RATIO_ROUNDING, PreparedProblem
from optimizer.trajectories import bspline
from optimizer.trajectories.spline import Spline

# fractions of the time left for path planning, and for planning and the solves from planned paths together
PLANNING, PATIENCE = 0.1, 0.3
# planned paths longer than this multiple of the shortest one are skipped
DETOUR = 1.3
# appended to the reason of a motion with a planned path as initial guess, and of one that follows a planned path
FROM_PLANNED_PATH = ", from a planned collision-free path"
ALONG_PLANNED_PATH = ", along a planned collision-free path"
# control points of a smooth path, tried in turn: the fewer there are, the wider its corners are rounded
CONTROL_POINTS = (9, 13, 19, 28, 42, 64, 96)
# points of a path at which the tool cone is checked
CONE_POINTS = 401


def planned_paths(prepared: PreparedProblem, q_start: Array, q_goal: Array, left: Deadline) -> list[Array]:
    """Planned joint paths (k, nq) [rad] from q_start to q_goal (nq,), the shortest first, without long detours.

    Planning takes at most the fraction PLANNING of the time until the deadline `left`.
    """
    v_max = prepared.problem.arm.active_limits.v_max
    planning = left.within(PLANNING * max(left.left, 0.0))
    paths = prepared.surroundings.planned_paths(q_start, q_goal, planning)
    return [path for path in paths if length(path, v_max) <= DETOUR * length(paths[0], v_max)]


def smooth_path(prepared: PreparedProblem, path: Array) -> Spline | None:
    """The smoothest spline along a joint path (k, nq) [rad] that is proven to be collision-free, as a motion of 1 s.

    Its control points lie on the path, evenly spaced by its length with each joint divided by its speed limit. Every
    piece of it therefore stays within the convex hull of a short piece of the path. None if none is proven, or if the
    tool leaves its cone.
    """
    reached = lengths(path, prepared.problem.arm.active_limits.v_max)
    fraction = reached / reached[-1]
    for count in CONTROL_POINTS:
        knots = bspline.uniform(count).knots
        at = bspline.greville(knots)
        spline = Spline(bspline.DEGREE, knots, np.stack([np.interp(at, fraction, joint) for joint in path.T], axis=1))
        if _is_clear(prepared, spline):
            return spline
    return None


def _is_clear(prepared: PreparedProblem, path: Spline) -> bool:
    """Whether a path is proven to keep all margins, with its tool within the tool cone."""
    if prepared.path is not None:
        q = path.curve(np.linspace(0.0, path.duration, CONE_POINTS))
        if (prepared.path.ratios(q, np.zeros_like(q)) > 1 + RATIO_ROUNDING).any():
            return False
    return prepared.surroundings.worst_violation(path) is None
