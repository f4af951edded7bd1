"""Goals with several targets: the best one wins, and the answer reports on all others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import AnyOf, BranchFilter, OutsideLimits, Pose, UnreachableTargets, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.problem.problem import narrowed
from joulepath.optimizer.problem.targets import members, single
from tests.optimizer.moves import GOAL, HOME, START, limits, paper_poses, problem, tcp_pose
from tests.refusals import refusal_of
from tests.selection import long_but

# relative: in a search of its own every target's winner is refined over more control points, in a
# common one only the best of all, and refining gains some tenths of a percent
REFINEMENT = 5e-3
# relative; twice the possible loss of a solver that stops at a promised gain of 5e-5 of the cost
CONVERGED = 1e-3
FAR = Pose(
    np.block([[np.eye(3), np.array([[2.0], [0.0], [0.3]])], [np.zeros((1, 3)), np.ones((1, 1))]])
)
BEYOND = np.array([0.0, -1.57, 3.5, -1.57, -1.57, 0.0])


@pytest.mark.parametrize("position", long_but(range(1), range(3)))
def test_the_papers_orientations_are_one_request(position: int) -> None:
    """One request with the paper's five orientations equals the best of five requests.

    The answer names the reached orientation.
    """
    poses = paper_poses()[5 * position : 5 * position + 5]
    solution = optimize(problem(HOME, AnyOf(tuple(poses))))
    apart = [optimize(problem(HOME, pose)).energy.electrical.total for pose in poses]
    total = solution.energy.electrical.total
    assert solution.certificate.valid and solution.status == "optimal"
    assert total == pytest.approx(min(apart), rel=REFINEMENT)
    assert apart[solution.goal.target] == pytest.approx(total, rel=REFINEMENT)
    assert np.abs(tcp_pose(solution.goal.q).T - poses[solution.goal.target].T).max() < 1e-6
    assert {candidate.goal_target for candidate in solution.candidates} == set(range(5))
    assert solution.lower_bound <= min(apart)
    assert solution.unreachable == []


def test_one_of_one_is_that_one() -> None:
    pose = tcp_pose(GOAL)
    alone, listed = (optimize(problem(goal=goal)) for goal in (pose, AnyOf((pose,))))
    assert listed.energy.electrical.total == pytest.approx(
        alone.energy.electrical.total, rel=CONVERGED
    )
    assert len(listed.candidates) == len(alone.candidates)


def test_both_ends_may_be_any_of_several() -> None:
    """Both ends may be lists that mix joints and poses.

    The cheapest pair comes last: it stays at a start that nearly equals a goal.
    """
    other = START + 1.0
    solution = optimize(
        problem(AnyOf((other, START)), AnyOf((tcp_pose(GOAL), GOAL + 0.3, START + 0.01)))
    )
    assert (solution.start.target, solution.goal.target) == (1, 2)
    assert solution.trajectory.q[0] == pytest.approx(START)
    assert solution.trajectory.q[-1] == pytest.approx(START + 0.01)
    assert solution.certificate.valid
    pairs = {(candidate.start_target, candidate.goal_target) for candidate in solution.candidates}
    assert pairs == {(s, g) for s in range(2) for g in range(3)}


def test_what_is_out_of_reach_is_named_and_left_out() -> None:
    solution = optimize(problem(goal=AnyOf((FAR, tcp_pose(GOAL), BEYOND))))
    assert solution.goal.target == 1
    assert [(each.end, each.target) for each in solution.unreachable] == [("goal", 0), ("goal", 2)]
    assert (
        "out of reach" in solution.unreachable[0].reason
        and "elbow_joint" in solution.unreachable[1].reason
    )
    assert {candidate.goal_target for candidate in solution.candidates} == {1}


def test_nothing_within_reach_is_an_error_that_names_each() -> None:
    with pytest.raises(UnreachableTargets) as refusal:
        optimize(problem(goal=AnyOf((FAR, BEYOND))))
    assert refusal.value.target == "goal"
    assert [each.target for each in refusal.value.unreachable] == [0, 1]


def test_the_branch_asked_for_holds_for_each_pose() -> None:
    wanted = BranchFilter(elbow="down")
    solution = optimize(problem(HOME, AnyOf(tuple(paper_poses()[:5])), branch=wanted))
    assert {candidate.goal.split("/")[1] for candidate in solution.candidates} == {"down"}


def test_a_motion_is_certified_against_its_own_target() -> None:
    task = problem(goal=AnyOf((FAR, GOAL)))
    assert single(narrowed(task, 0, 1).goal) == pytest.approx(np.asarray(members(task.goal)[1]))
    with pytest.raises(ValueError, match="narrow"):
        single(task.goal)


@pytest.mark.parametrize("windings", [True, False])
def test_more_pairs_than_can_be_named_are_refused(windings: bool) -> None:
    """64 poses at both ends make millions of pairs, too many to report.

    A list of 64 poses at one end is accepted without windings.
    """
    poses = tuple(tcp_pose(GOAL + 0.001 * k) for k in range(64))
    with refusal_of("goal", match="fewer"):
        optimize(problem(AnyOf(poses), AnyOf(poses), windings=windings))


def bad(values: list[Any]) -> Any:
    return problem(goal=AnyOf(tuple(values)))


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ([], "any_of"),
        ([GOAL] * 65, "any_of"),
        ([AnyOf((GOAL,))], "any_of"),
        ([GOAL, GOAL[:5]], "goal.any_of.1.q"),
        ([GOAL, np.full(6, np.nan)], "goal.any_of.1.q"),
        ([None], "goal.any_of.0.q"),
    ],
)
def test_what_is_no_list_of_targets_is_refused(values: list[Any], field: str) -> None:
    with refusal_of(field):
        bad(values)


def test_tightened_limits_make_joints_unreachable_not_wrong() -> None:
    narrow = limits(q_max=1.65)
    goals: tuple[Array, ...] = (GOAL + np.array([0.6, 0, 0, 0, 0, 0]), GOAL)
    solution = optimize(problem(goal=AnyOf(goals), limits=narrow))
    assert (solution.goal.target, solution.unreachable[0].target) == (1, 0)
    with pytest.raises(OutsideLimits):
        problem(goal=goals[0], limits=narrow)
