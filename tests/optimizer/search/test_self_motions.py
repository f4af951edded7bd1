"""Poses on singularities: no configuration of the pose needs less than the answer or the bound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    BranchFilter,
    ConeOrientedPose,
    JoulepathError,
    Pose,
    Problem,
    Solution,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from tests.optimizer.kinematics.six_joints import KUKA, flange
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


def solved(start: Any, goal: Any, **given: Any) -> Solution:
    solution = optimize(problem(start, goal, **given))
    assert solution.certificate.valid
    assert solution.lower_bound <= energy(solution)
    return solution


def energy(solution: Solution) -> float:
    return solution.energy.electrical.total


def curves(q: Array) -> list[SelfMotion]:
    """The self-motions at the pose of a configuration."""
    found = required_inverse_kinematics(ROBOT, "goal").solve(tcp_pose(q).T, windings=False)
    return list(
        {
            each.self_motion: each.self_motion for each in found if each.self_motion is not None
        }.values()
    )


@pytest.mark.parametrize(
    "goal",
    [
        STRETCHED,
        pytest.param(STRAIGHT, marks=pytest.mark.long),
        pytest.param(UPRIGHT, marks=pytest.mark.long),
    ],
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
    # the solved configurations are samples, so the optimum is not proven
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
    """Answers near a singularity agree with each other.

    On the singularity of the elbow, the answer agrees too. On the singularity of the wrist, more
    configurations reach the pose, and the answer may need less.
    """
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


def test_a_branch_may_be_asked_for_on_its_singularity() -> None:
    both = [
        energy(
            solved(
                START,
                tcp_pose(STRAIGHT),
                branch=BranchFilter(shoulder="left", elbow=side),
                windings=False,
            )
        )
        for side in ("up", "down")
    ]
    assert min(both) == pytest.approx(
        energy(solved(START, tcp_pose(STRAIGHT), windings=False)), rel=REFINED
    )


def test_a_free_turn_about_the_last_axis_may_meet_a_stretched_wrist() -> None:
    """The wrist is stretched in all allowed orientations."""
    pose = ConeOrientedPose.about(tcp_pose(STRETCHED), np.array([0.0, 0.0, 1.0]))
    answer = solved(START, pose)
    assert energy(answer) <= energy(solved(START, tcp_pose(STRETCHED))) * (1 + REFINED)


BESIDE = np.array([0.0, -1.4, 1.5, 0.2, 0.5, 0.1])
ALIGNED = np.array([0.3, -1.2, 1.4, 0.5, 0.0, -0.4])
# s: far more than any search takes, even on a busy machine
AMPLE = 300.0


def answer(goal: Array | Pose) -> Solution:
    return optimize(Problem(arm=Arm(robot=KUKA), start=BESIDE, goal=goal, deadline=AMPLE))


@pytest.mark.parametrize("every", long_but((False,), (False, True)))
def test_no_member_needs_less(every: bool) -> None:
    """The answer beats three nearby members, or 24 members per position of the arm."""
    found = answer(Pose(flange(KUKA, ALIGNED)))
    energy = found.energy.electrical.total
    assert found.certificate.valid and found.complete and found.lower_bound <= energy
    assert np.abs(flange(KUKA, found.goal.q) - flange(KUKA, ALIGNED)).max() < 1e-9
    branches = required_inverse_kinematics(KUKA, "goal").branches(flange(KUKA, ALIGNED))
    motions = {
        each.self_motion: each.self_motion for each in branches if each.self_motion is not None
    }
    own = min(motions.values(), key=lambda each: np.abs(each.q[:3] - found.goal.q[:3]).max())
    parameters = (
        np.linspace(-3, 3, 24)
        if every
        else own.parameter(found.goal.q) + np.array([-0.3, -0.01, 0.3])
    )
    tried = 0
    for motion in motions.values() if every else [own]:
        for member in motion.at(parameters):
            if ((member < KUKA.limits.q_min) | (member > KUKA.limits.q_max)).any():
                continue
            try:
                other = answer(member).energy.electrical.total
            except JoulepathError:
                continue
            tried += 1
            assert found.lower_bound <= other and energy <= other * (1 + REFINED)
    assert tried >= 3
