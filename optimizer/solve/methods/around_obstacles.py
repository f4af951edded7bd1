"""Motions along smooth planned paths, for methods whose own path is one fixed curve that
collides."""

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
    PATIENCE,
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
)
from joulepath.optimizer.solve.methods.sqp_method import with_effort

# the motion of a method along a smooth path, given as a motion of 1 s
Law = Callable[[Spline], SolveResult]


def around_obstacles(
    method: Method, reason: SolveReason, collision: Clearance, law: Law
) -> SolveResult:
    """The motion of least energy along smooth planned paths, for a method whose own path collides.

    A candidate is not solved further if its own path needs at least as much energy as the best
    motion known, even without obstacles.

    Args:
        method: the method.
        reason: the reason for the report, if no planned path leads to a motion.
        collision: the clearance that the method's own path violates.
        law: the method's motion along a path.
    """
    if (
        np.isfinite(method.incumbent_cost)
        and _cost_without_obstacles(method) >= method.incumbent_cost
    ):
        return SolveResult(
            SolveStatus.PRUNED, SolveReason.COLLIDES_AND_COSTS_MORE, collision=collision
        )
    patience = method.deadline.within(PATIENCE * max(method.deadline.left, 0.0))
    planned, found = plan(method), list[SolveResult]()
    failed = SolveResult(SolveStatus.FAILED, reason, collision=collision)
    paths = to_goal(method, planned)
    if not paths:
        return without_path(method, failed, planned)
    for path in paths:
        if found and patience.passed:
            break
        found.append(along_path(method, path, law))
    solved = [result for result in found if result.spline is not None]
    if solved:
        return with_effort(min(solved, key=lambda result: method.cost_of(result.spline)), found)
    if method.deadline.passed:
        return with_effort(SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED), found)
    return with_effort(replace(failed, note=found[0].message), found)


def along_path(method: Method, path: Array, law: Law) -> SolveResult:
    """The method's motion along the smooth path that follows a joint path (k, nq) [rad]."""
    with watch(method.deadline):
        try:
            smooth = smooth_path(method.prepared, path)
            if smooth is None:
                return SolveResult(SolveStatus.FAILED, SolveReason.NO_SMOOTH_PATH)
            result = law(smooth)
            if result.spline is None:
                return result
            hit = method.prepared.surroundings.worst_violation(result.spline)
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)
    if hit is not None:
        # the motion is fitted to the path, from which it differs by far less than the planner's
        # reserve
        failed = SolveResult(
            SolveStatus.FAILED, SolveReason.NO_COLLISION_FREE_MOTION, collision=hit
        )
        return with_effort(failed, [result])
    return replace(result, origin=MotionOrigin.ALONG_PLANNED_PATH)


def _cost_without_obstacles(method: Method) -> float:
    """Cost of the method's motion without collision checking; infinite if it finds none."""
    problem = method.prepared.problem
    free = PreparedProblem.of(replace(problem, arm=replace(problem.arm, collisions=False)))
    context = SolveContext(free, method.q_start, method.q_goal, method.deadline, method.interval)
    unobstructed = type(method)(context)
    return unobstructed.cost_of(unobstructed.solve().spline)
