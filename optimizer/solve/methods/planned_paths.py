"""Planned collision-free paths of a candidate, and smooth paths with proven clearance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.joint_path import path_length, path_lengths
from joulepath.optimizer.collision.planner.path_planner import PLANNER, Effort
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths, PlanningEnd
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PREPARED, PreparedProblem
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus


@dataclass(frozen=True)
class PlannedPathSettings:
    """Settings of the planning of collision-free paths for a candidate, and of smooth paths."""

    time_share: float = 0.75
    """Share of the time left that a planning may take; the rest is for the solves."""

    few_states: int = 20_000
    """States that the first planning to a goal may check, and all of them once a motion is
    known."""

    most_states: int = PLANNER.max_states
    """States that a thorough planning may check."""

    effort_of_sole: Effort = field(
        default_factory=lambda: Effort(paths=16, more_states=36_000, easy=1_000)
    )
    """Effort for the only candidate. In narrow spaces, the first paths are often long detours, and
    planning takes less time than a solve: with 4 paths and 12,000 states, motions in cages needed
    1.2 % more energy in the mean, up to 17 % in one."""

    effort_in_haste: Effort = field(
        default_factory=lambda: Effort(paths=4, more_states=12_000, easy=1_000)
    )
    """Effort for the only candidate if less than `ample_time` is left."""

    ample_time: float = 3.0
    """Time left [s] from which `effort_of_sole` is used: planning takes up to 0.3 s, and each of
    the solves in narrow spaces as long. With 0.8 s, half of the cages had no motion in time."""

    effort_of_first: Effort = field(
        default_factory=lambda: Effort(paths=16, more_states=36_000, easy=20_000)
    )
    """Effort until a motion is known. Where the first path is hard to find, it is often a long
    detour: in one cage, a motion along it needed 1.56 times as much energy."""

    effort_of_another: Effort = field(default_factory=lambda: Effort(more_states=1_000))
    """Effort once a motion is known: a second path of another candidate seldom leads to a better
    motion."""

    patience: float = 0.3
    """Share of the time left that a method following paths gives to the paths after the first."""

    detour: float = 1.3
    """Ratio to the length of the shortest path above which a path is skipped."""

    most_followed: int = 3
    """Largest number of paths to a goal from which motions are solved; motions from a fourth one
    needed 0.04 % less energy in the mean."""

    control_points: tuple[int, ...] = (9, 13, 19, 28, 42, 64, 96)
    """Control points of a smooth path, tried in turn: the fewer, the wider its corners are
    rounded."""

    cone_samples: int = 401
    """Points of a smooth path at which the tool cone is checked."""


PLANNED_PATHS = PlannedPathSettings()


def plan(method: Method) -> PlannedPaths:
    """Plan paths of a method's candidate.

    The planning checks few states. If that failed before and no motion is known, it checks many
    states, and plans to the goals of other candidates too.
    """
    settings = PLANNED_PATHS
    context = method.context
    deadline = method.deadline
    surroundings = method.prepared.surroundings
    left = deadline.left
    others, unknown = context.other_goals(), np.isinf(method.incumbent_cost)
    tried = context.was_postponed or surroundings.seems_enclosed(method.q_start, method.q_goal)
    thorough = unknown and (tried or not others)
    if context.is_sole:
        ample = deadline.left >= settings.ample_time
        effort = settings.effort_of_sole if ample else settings.effort_in_haste
    else:
        effort = settings.effort_of_first if unknown else settings.effort_of_another
    return surroundings.planned_paths(
        method.q_start,
        method.q_goal,
        deadline.within(settings.time_share * left) if np.isfinite(left) else deadline,
        others if thorough else (),
        replace(effort, most_states=settings.most_states if thorough else settings.few_states),
    )


def to_goal(method: Method, planned: PlannedPaths) -> list[Array]:
    """Planned paths (k, nq) [rad] to the method's goal, the shortest first: a few, and none with a
    long detour.
    """
    v_max = method.prepared.problem.arm.active_limits.v_max
    paths = planned.ending_at(method.q_goal)[: PLANNED_PATHS.most_followed]
    longest = PLANNED_PATHS.detour
    return [
        path for path in paths if path_length(path, v_max) <= longest * path_length(paths[0], v_max)
    ]


def without_path(method: Method, failed: SolveResult, planned: PlannedPaths) -> SolveResult:
    """Result of a candidate without a path to its goal: failed, or postponed.

    The candidate is postponed if a path leads to another candidate, or if no motion is known and
    few states have been checked.

    Args:
        method: the method of the candidate.
        failed: result of the attempts without a path.
        planned: outcome of the planning.
    """
    few_states = planned.checked_states < PLANNED_PATHS.most_states
    few = planned.end is PlanningEnd.EXHAUSTED and few_states
    if planned.paths or (
        few and np.isinf(method.incumbent_cost) and not method.context.was_postponed
    ):
        return replace(failed, status=SolveStatus.POSTPONED)
    late = planned.end is PlanningEnd.CUT_SHORT
    return replace(failed, status=SolveStatus.FAILED, note=planned.message, cut_short=late)


def no_polynomial_around(failed: SolveResult, degree: int) -> SolveResult:
    """The failed result of a method whose polynomials of a given degree collide."""
    return replace(failed, reason=SolveReason.NO_POLYNOMIAL_AROUND, figures=(degree,))


def smooth_path(prepared: PreparedProblem, path: Array) -> Spline | None:
    """The smoothest spline along a joint path with proven clearance, as a motion of 1 s.

    The control points lie on the path, evenly spaced by its length in units of the joints' speed
    limits. Every piece of the spline therefore stays within the convex hull of a short piece of the
    path.

    Args:
        prepared: the problem.
        path: joint path, shape (k, nq) [rad].

    Returns:
        The spline; None if no clearance is proven, or if the tool leaves its cone.
    """
    reached = path_lengths(path, prepared.problem.arm.active_limits.v_max)
    fraction = reached / reached[-1]
    for count in PLANNED_PATHS.control_points:
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
    """Whether all margins along a path are proven, and the tool stays within its cone."""
    if prepared.path is not None:
        q = path.curve(np.linspace(0.0, path.duration, PLANNED_PATHS.cone_samples))
        if (prepared.path.ratios(q, np.zeros_like(q)) > 1 + PREPARED.ratio_rounding).any():
            return False
    return prepared.surroundings.worst_violation(path) is None
