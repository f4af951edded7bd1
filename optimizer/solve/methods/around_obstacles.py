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
from joulepath.optimizer.solve.methods.method import (
    DEADLINE_PASSED,
    Method,
    SolveResult,
    SolveStatus,
)
from joulepath.optimizer.solve.methods.planned_paths import (
    ALONG_PLANNED_PATH,
    PATIENCE,
    plan,
    smooth_path,
    to_goal,
    without_path,
)
from joulepath.optimizer.solve.methods.sqp_method import NO_BETTER, with_effort

# the motion of a method along a smooth path, given as a motion of 1 s
Law = Callable[[Spline], SolveResult]


def around_obstacles(method: Method, own: str, collision: Clearance, law: Law) -> SolveResult:
    """The motion of least energy along smooth planned paths, for a method whose `own` path has a
    `collision`.

    A candidate is not solved further if its own path needs at least as much energy as the best
    motion known, even without obstacles.
    """
    if np.isfinite(method.best_known) and _cost_without_obstacles(method) >= method.best_known:
        return SolveResult(SolveStatus.PRUNED, NO_BETTER, collision=collision)
    patience = method.deadline.within(PATIENCE * max(method.deadline.left, 0.0))
    planned, found = plan(method), list[SolveResult]()
    failed = SolveResult(SolveStatus.FAILED, f"on {own}, {collision.message}", collision=collision)
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
        return with_effort(SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED), found)
    return with_effort(replace(failed, reason=f"{failed.reason}; {found[0].reason}"), found)


def along_path(method: Method, path: Array, law: Law) -> SolveResult:
    """The method's motion along the smooth path that follows a joint path (k, nq) [rad]."""
    with watch(method.deadline):
        try:
            smooth = smooth_path(method.prepared, path)
            if smooth is None:
                return SolveResult(
                    SolveStatus.FAILED, "no smooth path around it is proven to be collision-free"
                )
            result = law(smooth)
            if result.spline is None:
                return result
            hit = method.prepared.surroundings.worst_violation(result.spline)
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED)
    if hit is not None:
        # the motion is fitted to the path, from which it differs by far less than the planner's
        # reserve
        failed = SolveResult(
            SolveStatus.FAILED, f"found no collision-free motion: {hit.message}", collision=hit
        )
        return with_effort(failed, [result])
    return replace(result, reason=f"{result.reason}{ALONG_PLANNED_PATH}")


def _cost_without_obstacles(method: Method) -> float:
    """Cost of the method's motion without collision checking; infinite if it finds none."""
    problem = method.prepared.problem
    free = PreparedProblem.of(replace(problem, arm=replace(problem.arm, collisions=False)))
    alike = type(method)(free, method.q_start, method.q_goal, method.deadline, method.interval)
    return alike.cost_of(alike.solve().spline)
