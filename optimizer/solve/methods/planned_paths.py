"""Planned collision-free paths of a candidate, and smooth paths along them with proven
clearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.path_planner import (
    MOST_STATES,
    USUAL,
    Effort,
    PlannedPaths,
    PlanningEnd,
    length,
    lengths,
)
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PREPARED, PreparedProblem
from joulepath.optimizer.solve.methods.method import Method, SolveResult, SolveStatus

# a planning may take this fraction of the time left: the rest is for the solves. The first one to a
# goal, and all of them once a motion is known, may check so many states
PLANNING, FEW_STATES = 0.75, 20_000
# for the only candidate there is more time: in narrow spaces, motions from four paths differ by
# some percent
OF_SOLE = Effort(paths=4, more_states=12_000, easy=1_000)
# once a motion is known, a second path of another candidate seldom leads to a better one
OF_ANOTHER = Effort(more_states=1_000)
# fraction of the time left that a method which follows paths gives to those after the first
PATIENCE = 0.3
# planned paths longer than this multiple of the shortest one are skipped
DETOUR = 1.3
# appended to the reason of a motion with a planned path as initial guess, and of one that follows a
# planned path
FROM_PLANNED_PATH = ", from a planned collision-free path"
ALONG_PLANNED_PATH = ", along a planned collision-free path"
# control points of a smooth path, tried in turn: the fewer there are, the wider its corners are
# rounded
CONTROL_POINTS = (9, 13, 19, 28, 42, 64, 96)
# points of a path at which the tool cone is checked
CONE_POINTS = 401


def plan(method: Method) -> PlannedPaths:
    """Planned paths of a method's candidate, in a few states.

    If that has failed, and no motion is known: in many states, and also to the goals of other
    candidates.
    """
    left, surroundings, others = (
        method.deadline.left,
        method.prepared.surroundings,
        method.other_goals(),
    )
    tried = method.was_postponed or surroundings.seems_enclosed(method.q_start, method.q_goal)
    thorough = np.isinf(method.best_known) and (tried or not others)
    effort = OF_SOLE if method.is_sole else USUAL if np.isinf(method.best_known) else OF_ANOTHER
    return surroundings.planned_paths(
        method.q_start,
        method.q_goal,
        method.deadline.within(PLANNING * left) if np.isfinite(left) else method.deadline,
        others if thorough else (),
        replace(effort, most_states=MOST_STATES if thorough else FEW_STATES),
    )


def to_goal(method: Method, planned: PlannedPaths) -> list[Array]:
    """The paths (k, nq) [rad] that lead to the method's goal, the shortest first, without long
    detours.
    """
    v_max, paths = (
        method.prepared.problem.arm.active_limits.v_max,
        planned.leading_to(method.q_goal),
    )
    return [path for path in paths if length(path, v_max) <= DETOUR * length(paths[0], v_max)]


def without_path(method: Method, failed: SolveResult, planned: PlannedPaths) -> SolveResult:
    """The result where no path leads to the goal: failed, or postponed if other candidates come
    first.

    They do if a path leads to one of them, or, as long as no motion is known, if few states have
    been checked.
    """
    few = planned.end is PlanningEnd.EXHAUSTED and planned.checked_states < MOST_STATES
    if planned.paths or (few and np.isinf(method.best_known) and not method.was_postponed):
        return replace(failed, status=SolveStatus.POSTPONED)
    late = planned.end is PlanningEnd.CUT_SHORT
    return replace(
        failed,
        status=SolveStatus.FAILED,
        reason=f"{failed.reason}; {planned.message}",
        cut_short=late,
    )


def no_polynomial_around(failed: SolveResult, degree: int) -> SolveResult:
    """A failed result of a method whose one polynomial per joint collides, with a reason that says
    so.
    """
    assert failed.collision is not None
    reason = (
        f"no polynomial of degree {degree} was found around the obstacles: "
        f"{failed.collision.message}"
    )
    return replace(failed, reason=reason)


def smooth_path(prepared: PreparedProblem, path: Array) -> Spline | None:
    """The smoothest spline along a joint path (k, nq) [rad] that is proven to be collision-free, as
    a motion of 1 s.

    Its control points lie on the path, evenly spaced by its length with each joint divided by its
    speed limit. Every piece of it therefore stays within the convex hull of a short piece of the
    path. None if none is proven, or if the tool leaves its cone.
    """
    reached = lengths(path, prepared.problem.arm.active_limits.v_max)
    fraction = reached / reached[-1]
    for count in CONTROL_POINTS:
        knots = bspline.uniform(count).knots
        at = bspline.greville(knots)
        spline = Spline(
            bspline.DEGREE,
            knots,
            np.stack([np.interp(at, fraction, joint) for joint in path.T], axis=1),
        )
        if _is_clear(prepared, spline):
            return spline
    return None


def _is_clear(prepared: PreparedProblem, path: Spline) -> bool:
    """Whether a path is proven to keep all margins, with its tool within the tool cone."""
    if prepared.path is not None:
        q = path.curve(np.linspace(0.0, path.duration, CONE_POINTS))
        if (prepared.path.ratios(q, np.zeros_like(q)) > 1 + PREPARED.ratio_rounding).any():
            return False
    return prepared.surroundings.worst_violation(path) is None
