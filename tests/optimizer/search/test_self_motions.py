"""Poses that a singular arm reaches: answers need no more than to any of their configurations, the bound no more."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.dwell import Dwell
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import AnyOf
from joulepath.optimizer.search.candidates import bound, pairs
from joulepath.optimizer.search.ends import ends
from joulepath.optimizer.search.holding_cells import HoldingCells
from joulepath.optimizer.search.self_motion_bound import self_motion_bound
from joulepath.optimizer.solution import Solution
from tests.optimizer.moves import ROBOT, problem, tcp_pose
from tests.selection import long_but

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
STRETCHED = np.array([0.6, -1.2, 1.3, -0.8, 0.0, 0.4])  # wrist
STRAIGHT = np.array([0.6, -1.3, 0.0, -1.2, -1.2, 0.3])  # elbow
UPRIGHT = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])  # shoulder, elbow and wrist
# relative: the least step along a self-motion, 0.002 rad, and the solver's tolerance
REFINED = 1e-3
# relative difference of the energies of neighbouring poses
CONTINUOUS = 0.01
# relative
ROUNDING = 1e-12


def solved(start: Any, goal: Any, **given: Any) -> Solution:
    solution = optimize(problem(start, goal, **given))
    assert solution.certificate.valid
    assert solution.lower_bound <= energy(solution)
    return solution


def energy(solution: Solution) -> float:
    return solution.energy.electrical.total


def curves(q: Array) -> list[SelfMotion]:
    """The self-motions that hold the pose of a configuration."""
    found = required_inverse_kinematics(ROBOT, "goal").solve(tcp_pose(q).T, windings=False)
    return list({id(each.self_motion): each.self_motion for each in found if each.self_motion is not None}.values())


@pytest.mark.parametrize(
    "goal",
    [STRETCHED, pytest.param(STRAIGHT, marks=pytest.mark.long), pytest.param(UPRIGHT, marks=pytest.mark.long)],
    ids=["wrist", "elbow", "all"],
)
def test_a_pose_needs_no_more_than_its_configuration(goal: Array) -> None:
    for ends_of in ((START, goal), (goal, START)):
        given = solved(*ends_of)
        posed = solved(*(tcp_pose(end) if end is goal else end for end in ends_of))
        assert energy(posed) <= energy(given) * (1 + REFINED)
        assert posed.lower_bound <= energy(given)


@pytest.mark.parametrize("count", long_but((4,), (4, 7)))
def test_the_answer_is_the_best_of_the_curve(count: int) -> None:
    answer = solved(START, tcp_pose(STRETCHED))
    # what is solved is a sample: whether another is better is not proven
    assert answer.status == "feasible"
    for motion in curves(STRETCHED):
        lower, upper = motion.arcs[0]
        for member in motion.at(np.linspace(lower, upper, count)):
            try:
                other = solved(START, member)
            except JoulepathError:
                continue  # outside the limits, or in collision
            assert energy(answer) <= energy(other) * (1 + REFINED)
            assert answer.lower_bound <= energy(other)


@pytest.mark.parametrize("joint", long_but([4], [2, 4]))
def test_answers_next_to_a_singularity_are_those_beside_them(joint: int) -> None:
    """The elbow's also those on it. On the wrist's, more configurations reach the pose, and the answer may be less."""
    energies = []
    for away in (0.0, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3):
        goal = (STRAIGHT if joint == 2 else STRETCHED).copy()
        goal[joint] = away
        energies.append(energy(solved(START, tcp_pose(goal), windings=False)))
    on_it, *beside = energies
    assert np.ptp(beside) <= CONTINUOUS * max(beside)
    assert on_it <= min(beside) * (1 + REFINED)
    if joint == 2:
        assert on_it >= min(beside) * (1 - CONTINUOUS)


@pytest.mark.parametrize(
    "given",
    [
        {},
        pytest.param({"dwell": Dwell(time=4.0, hold="motors")}, marks=pytest.mark.long),
        pytest.param({"objective": "mechanical", "duration_max": 2.0}, marks=pytest.mark.long),
        pytest.param({"bus": Bus(mode="isolated")}, marks=pytest.mark.long),
    ],
    ids=["electrical", "dwell", "mechanical", "isolated"],
)
def test_no_member_of_a_curve_has_a_lower_bound_below_the_curves(
    given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bound of the curve is one over boxes; that of a pair is exact in displacement and potential energy. Here none
    has the copper loss of holding."""
    monkeypatch.setattr(HoldingCells, "of", lambda prepared: None)
    rng = np.random.default_rng(9)
    for q in rng.uniform(-2.5, 2.5, (6, 6)):
        q[4] = 0.0
        for asked in (problem(START, tcp_pose(q), **given), problem(tcp_pose(q), START, **given)):
            whole = family_of(asked)
            for motion in curves(q):
                for lower, upper in motion.arcs:
                    for member in motion.at(rng.uniform(lower, upper, 20)):
                        alone = bound_to(asked, member)
                        assert alone is None or alone >= whole * (1 - ROUNDING)


def family_of(asked: Problem) -> float:
    """The bound over the whole curve."""
    prepared = PreparedProblem.of(asked)
    candidates = pairs(prepared, ends(prepared, "start")[0], ends(prepared, "goal")[0])
    return self_motion_bound(prepared, candidates)


def bound_to(asked: Problem, member: Array) -> float | None:
    """The bound of the motion from or to one member; None if the arm cannot be there."""
    end = "start" if not isinstance(asked.start, np.ndarray) else "goal"
    prepared = PreparedProblem.of(replace(asked, **{end: member}))
    candidates = pairs(prepared, ends(prepared, "start")[0], ends(prepared, "goal")[0])
    try:
        bound(prepared, candidates)
    except JoulepathError:
        return None
    return min(each.lower_bound for each in candidates)


@pytest.mark.long
def test_between_two_curves() -> None:
    other = STRETCHED + np.array([-0.8, 0.3, -0.5, 0.2, 0.0, 0.1])
    answer = solved(tcp_pose(STRETCHED), tcp_pose(other), windings=False)
    assert energy(answer) <= energy(solved(STRETCHED, other)) * (1 + REFINED)


def test_a_branch_may_be_asked_for_on_its_singularity() -> None:
    both = [
        energy(solved(START, tcp_pose(STRAIGHT), branch=BranchFilter(shoulder="left", elbow=side), windings=False))
        for side in ("up", "down")
    ]
    assert min(both) == pytest.approx(energy(solved(START, tcp_pose(STRAIGHT), windings=False)), rel=REFINED)


@pytest.mark.long
def test_one_of_several_targets_and_a_store() -> None:
    """A store's answer is found again among the candidates, whose samples do not hold it."""
    targets = AnyOf((tcp_pose(STRETCHED), tcp_pose(STRAIGHT)))
    plain = solved(START, targets, windings=False)
    stored = solved(START, targets, windings=False, bus=Bus(mode="storage", capacity=50.0, power=200.0, efficiency=0.9))
    assert energy(stored) <= energy(plain) * (1 + REFINED)


def test_a_free_turn_about_the_last_axis_may_meet_a_stretched_wrist() -> None:
    """The wrist is stretched in each of the allowed orientations."""
    pose = ConeOrientedPose.about(tcp_pose(STRETCHED), np.array([0.0, 0.0, 1.0]))
    answer = solved(START, pose)
    assert energy(answer) <= energy(solved(START, tcp_pose(STRETCHED))) * (1 + REFINED)
