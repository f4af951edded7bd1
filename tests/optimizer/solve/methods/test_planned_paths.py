"""Planned paths of candidates: goals by full turns, checked states, and early ends of solves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import AnyOf, optimize
from joulepath.optimizer.collision.planner.joint_path import path_length, path_samples
from joulepath.optimizer.collision.planner.path_planner import USUAL_EFFORT, Effort, plan_paths
from joulepath.optimizer.collision.planner.planning_result import PlannedPaths, PlanningEnd
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods import free_spline, planned_paths
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.method import above
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
)
from joulepath.optimizer.solve.methods.sqp_method import SQP_METHOD
from joulepath.optimizer.surroundings import Surroundings
from tests.optimizer.collision.test_path_planner import (
    AMPLE,
    between,
    least,
    problem,
    task,
    walled_in,
)
from tests.selection import long_but


def test_a_known_path_leads_to_goals_that_differ_by_full_turns() -> None:
    """A path to a goal is reused for the goal after a full turn of a wrist."""
    arm, q_start, q_goal = task("cage")
    (path, *_) = plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE)).paths
    turned = q_goal - 2 * np.pi * np.sign(q_goal) * np.eye(6)[3]
    alone = plan_paths(arm, q_start, turned, Deadline.after(AMPLE), Effort(paths=1))
    beside = plan_paths(arm, q_start, turned, Deadline.after(AMPLE), template=path)
    (found,) = beside.paths
    np.testing.assert_array_equal(found[[0, -1]], [q_start, turned])
    assert least(arm, between(found)) > 0
    assert beside.checked_states < alone.checked_states


def test_more_paths_are_planned_only_where_the_first_is_hard_to_find() -> None:
    """There are more than two paths around the post; an easy first path gives the usual paths."""
    ends, more = task("post"), Effort(paths=4, more_states=12_000)
    usual, many, easy = (
        plan_paths(*ends, Deadline.after(AMPLE), effort).paths
        for effort in (USUAL_EFFORT, more, replace(more, easy=10**9))
    )
    assert 2 == len(usual) < len(many) <= 4
    for path, same in zip(usual, easy, strict=True):
        np.testing.assert_array_equal(path, same)


@pytest.mark.parametrize("goals", long_but([2], [1, 2]))
def test_more_paths_are_planned_for_the_only_candidate_and_after_a_hard_first_path(
    goals: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm, q_start, q_goal = task("post")
    asked, efforts, plan = problem(arm, q_start, q_goal), list[Effort](), Surroundings.planned_paths

    def noted(*given: Any, **named: Any) -> PlannedPaths:
        # baselines name their effort
        if not named:
            efforts.append(given[-1])
        return plan(*given, **named)

    monkeypatch.setattr(Surroundings, "planned_paths", noted)
    beside = [q_goal + 0.01 * k for k in range(goals)]
    optimize(replace(asked, goal=AnyOf(beside) if goals > 1 else q_goal))
    settings = planned_paths.PLANNED_PATHS
    expected = settings.effort_of_sole if goals == 1 else settings.effort_of_first
    assert replace(efforts[0], most_states=expected.most_states) == expected


def test_the_shortest_of_many_paths_are_followed() -> None:
    """A longer search finds shorter ways around the post, and three of them are followed."""
    arm, q_start, q_goal = task("post")
    prepared, v_max = PreparedProblem.of(problem(arm, q_start, q_goal)), arm.active_limits.v_max
    method = FreeSpline(SolveContext.of(prepared, q_start, q_goal, NEVER))
    few, many = (
        plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE), replace(effort, easy=0))
        for effort in (Effort(paths=2), planned_paths.PLANNED_PATHS.effort_of_sole)
    )
    followed = planned_paths.to_goal(method, many)
    lengths = [path_length(path, v_max) for path in followed]
    assert len(many.paths) > len(followed) == planned_paths.PLANNED_PATHS.most_followed
    assert lengths == sorted(lengths)
    assert lengths[0] <= min(path_length(path, v_max) for path in few.paths)
    assert lengths[-1] <= planned_paths.PLANNED_PATHS.detour * lengths[0]


def test_a_solve_among_obstacles_ends_once_it_cannot_come_near_the_best_motion() -> None:
    arm, q_start, q_goal = task("post")
    prepared = PreparedProblem.of(problem(arm, q_start, q_goal))
    (path, *_) = plan_paths(arm, q_start, q_goal, Deadline.after(AMPLE)).paths
    path, t = path_samples(path, 1.0, arm.active_limits.v_max)

    def solved(incumbent_cost: float) -> SolveResult:
        context = SolveContext.of(prepared, q_start, q_goal, NEVER)
        return FreeSpline(replace(context, incumbent_cost=incumbent_cost)).along_path(path, t)

    alone = solved(np.inf)
    energy = prepared.cost_of(alone.spline)
    near = solved(energy / SQP_METHOD.obstacle_margin * 1.01)
    assert alone.spline is not None and near.spline is not None
    np.testing.assert_array_equal(near.spline.control_points, alone.spline.control_points)
    assert 0 < solved(energy / 1.3).iterations < alone.iterations


@pytest.mark.parametrize(
    ("incumbent_cost", "was_postponed", "others", "thorough"),
    [
        (np.inf, False, 1, False),
        (np.inf, True, 1, True),
        (np.inf, False, 0, True),
        (1e3, True, 1, False),
    ],
)
def test_many_states_are_checked_only_where_few_were_in_vain(
    incumbent_cost: float,
    was_postponed: bool,
    others: int,
    thorough: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With no other candidate open, the planning between walls uses all its states.

    With other candidates open, it uses few states and the candidate is postponed.
    """
    limited = replace(planned_paths.PLANNED_PATHS, few_states=100, most_states=1_000)
    monkeypatch.setattr(planned_paths, "PLANNED_PATHS", limited)
    arm, q_start, q_goal = walled_in()
    prepared = PreparedProblem.of(problem(arm, q_start, q_goal))
    context = replace(
        SolveContext.of(prepared, q_start, q_goal, NEVER),
        incumbent_cost=incumbent_cost,
        was_postponed=was_postponed,
        other_goals=lambda: [q_goal] * others,
    )
    solver = FreeSpline(context)
    found = planned_paths.plan(solver)
    assert found.end is PlanningEnd.EXHAUSTED
    assert (found.checked_states >= 1_000) == thorough
    failed = planned_paths.without_path(
        solver, SolveResult(SolveStatus.FAILED, SolveReason.MOTION_COLLIDES), found
    )
    few = np.isinf(incumbent_cost) and not thorough
    assert failed.status is (SolveStatus.POSTPONED if few else SolveStatus.FAILED)


def test_a_multiple_of_an_energy_is_above_it_whatever_its_sign() -> None:
    assert (above(10.0, 1.5), above(-10.0, 1.5), above(0.0, 1.5), above(np.inf, 1.5)) == (
        15.0,
        -5.0,
        0.0,
        np.inf,
    )


@pytest.mark.long
def test_a_motion_that_left_an_obstacle_at_great_cost_is_compared_with_planned_paths(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The motion may have left the obstacle on the wrong side: the cheaper motion is kept."""
    arm, q_start, q_goal = task("post")
    # hulls pass the post at less cost
    arm = replace(arm, robot=replace(arm.robot, hulls=()))
    prepared = PreparedProblem.of(problem(arm, q_start, q_goal))
    context = SolveContext.of(prepared, q_start, q_goal, NEVER)
    with monkeypatch.context() as alone:
        settings = free_spline.FREE_SPLINE
        alone.setattr(free_spline, "FREE_SPLINE", replace(settings, detour_cost=np.inf))
        direct = FreeSpline(context).solve()
    energy = prepared.cost_of(direct.spline)
    assert (
        direct.unobstructed_cost is not None
        and energy > settings.detour_cost * direct.unobstructed_cost
    )
    compared = FreeSpline(context).solve()
    assert prepared.cost_of(compared.spline) <= energy and compared.solves > direct.solves
    planned = MotionOrigin.FROM_PLANNED_PATH
    assert (compared.origin is planned) == (prepared.cost_of(compared.spline) < energy)
    # a planned path without a better motion
    costlier = replace(compared, spline=direct.spline, origin=planned)
    monkeypatch.setattr(FreeSpline, "from_planned_paths", lambda *_: costlier)
    kept = FreeSpline(context).solve()
    assert (
        kept.message == direct.message
        and prepared.cost_of(kept.spline) == energy
        and not kept.cut_short
    )
    # if the deadline ends the comparison, the result must not count as optimal
    for late in (
        SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED),
        replace(direct, status=SolveStatus.FAILED, cut_short=True),
    ):
        monkeypatch.setattr(FreeSpline, "from_planned_paths", lambda *_, late=late: late)
        kept = FreeSpline(context).solve()
        assert (
            kept.cut_short
            and kept.status is SolveStatus.SOLVED
            and prepared.cost_of(kept.spline) == energy
        )
