"""Motions along smooth planned paths, for methods with one fixed path of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.planned_paths import (
    PLANNED_PATHS,
    plan,
    smooth_path,
    to_goal,
    without_path,
)
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
    with_effort,
)

# solves for the motion of a method along a smooth path, given as a motion of 1 s
SolveAlong = Callable[[Spline], SolveResult]


def around_obstacles(
    method: Method, reason: SolveReason, collision: Clearance, solve_along: SolveAlong
) -> SolveResult:
    """The motion of least energy along smooth planned paths, for a method whose own path collides.

    The candidate is pruned if its own path, without obstacles, costs at least as much as the
    incumbent.

    Args:
        method: the method.
        reason: the reason for the report, if no planned path leads to a motion.
        collision: the clearance that the method's own path violates.
        solve_along: solves for the method's motion along a path.
    """
    if (
        np.isfinite(method.incumbent_cost)
        and _cost_without_obstacles(method) >= method.incumbent_cost
    ):
        return SolveResult(
            SolveStatus.PRUNED, SolveReason.COLLIDES_AND_COSTS_MORE, collision=collision
        )
    patience = method.deadline.within(PLANNED_PATHS.patience * max(method.deadline.left, 0.0))
    planned, found = plan(method), list[SolveResult]()
    failed = SolveResult(SolveStatus.FAILED, reason, collision=collision)
    paths = to_goal(method, planned)
    if not paths:
        return without_path(method, failed, planned)
    for path in paths:
        if found and patience.passed:
            break
        found.append(along_path(method, path, solve_along))
    solved = [result for result in found if result.spline is not None]
    if solved:
        return with_effort(min(solved, key=lambda result: method.cost_of(result.spline)), found)
    if method.deadline.passed:
        return with_effort(SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED), found)
    return with_effort(replace(failed, note=found[0].message), found)


def along_path(method: Method, path: Array, solve_along: SolveAlong) -> SolveResult:
    """The method's motion along a smooth path fitted to a joint path (k, nq) [rad]."""
    with watch(method.deadline):
        try:
            smooth = smooth_path(method.prepared, path)
            if smooth is None:
                return SolveResult(SolveStatus.FAILED, SolveReason.NO_SMOOTH_PATH)
            result = solve_along(smooth)
            if result.spline is None:
                return result
            hit = method.prepared.surroundings.worst_violation(result.spline)
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)
    if hit is not None:
        # unlikely: the fit to the path is far closer than the reserve of the planner
        failed = SolveResult(
            SolveStatus.FAILED, SolveReason.NO_COLLISION_FREE_MOTION, collision=hit
        )
        return with_effort(failed, [result])
    return replace(result, origin=MotionOrigin.ALONG_PLANNED_PATH)


def _cost_without_obstacles(method: Method) -> float:
    """Cost of the method's motion without collision checking; infinite without a motion."""
    problem = method.prepared.problem
    free = PreparedProblem.of(replace(problem, arm=replace(problem.arm, collisions=False)))
    context = SolveContext(free, method.q_start, method.q_goal, method.deadline, method.interval)
    unobstructed = type(method)(context)
    return unobstructed.cost_of(unobstructed.solve().spline)
