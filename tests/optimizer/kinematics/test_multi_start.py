"""Arms without a closed form: many starts find the branches, and the result is marked as
incomplete.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Pose, Problem, Robot, UnreachablePose, optimize
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.multi_start import MULTI_START, MultiStart
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.optimizer.chains import move, serial_chain
from tests.optimizer.kinematics.six_joints import (
    ACCURACY,
    FOUND,
    UR5E,
    calibrated,
    flange,
    inside,
    solved,
)
from tests.selection import long_but

CHAIN = serial_chain(6)
# axes turned by up to 17° and moved by up to 0.3 m: none are parallel, and none meet
ODD = [calibrated(UR5E, 0.3, seed) for seed in (1, 2, 3)]
# deadline beyond the time of any search, even on a busy machine [s]
AMPLE = 300.0


@pytest.mark.parametrize("count", long_but((3,), (3, 300)))
@pytest.mark.parametrize("number", range(4))
def test_the_configuration_is_found(number: int, count: int) -> None:
    robot = [CHAIN, *ODD][number]
    assert URClosedForm.of(robot.model) is None and DecomposedArm.of(robot.model) is None
    rng, missed = np.random.default_rng(31), 0
    for _ in range(count):
        found = solved(robot, inside(robot, rng))
        missed += found.away > FOUND
        assert found.error < ACCURACY and not found.twice
        assert len(found.branches) <= MULTI_START.most_branches and len(found.branches) % 2 == 0, (
            "branches come in pairs"
        )
    assert missed <= 0.001 * count
    assert not required_inverse_kinematics(robot, "goal").complete


def test_the_same_pose_has_the_same_answer() -> None:
    T = flange(CHAIN, move(6)[0])
    once, again = (MultiStart.of(Chain.of(CHAIN.model)) for _ in range(2))
    assert once is not None and again is not None
    assert (once.solve(T)[0] == again.solve(T)[0]).all()
    assert [str(label) for label in once.solve(T)[1]] == [
        f"branch {k + 1}" for k in range(len(once.solve(T)[0]))
    ]


def test_a_label_is_that_of_the_configuration() -> None:
    inverse = required_inverse_kinematics(CHAIN, "goal")
    for branch in inverse.branches(flange(CHAIN, move(6)[0])):
        assert inverse.label(branch.q) == branch.label


def test_out_of_reach_no_distance_is_claimed() -> None:
    T = np.eye(4)
    T[0, 3] = 3.0
    with pytest.raises(UnreachablePose, match="beyond the stretched arm") as refusal:
        required_inverse_kinematics(CHAIN, "goal").solve(T)
    assert refusal.value.distance is None


def answered(robot: Robot, from_pose: bool) -> tuple[float, float, str, bool]:
    """Lower bound and energy [J], status and completeness of a motion to a pose."""
    start, goal = move(6)
    problem = Problem(
        arm=Arm(robot=robot),
        start=Pose(flange(robot, start)) if from_pose else start,
        goal=Pose(flange(robot, goal)),
        deadline=AMPLE,
        windings=False,
    )
    found = optimize(problem)
    assert found.certificate.valid
    return found.lower_bound, found.energy.electrical.total, found.status, found.complete


@pytest.mark.long
def test_an_answer_over_branches_that_may_be_missing_is_not_optimal() -> None:
    robot = replace(CHAIN, default_motion=None)
    bound, energy, status, complete = answered(robot, from_pose=False)
    assert status == "feasible" and not complete
    # The bound holds for every configuration of the goal, not for the candidates alone.
    assert bound <= energy
