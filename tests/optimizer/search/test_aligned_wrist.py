"""A pose that a spherical wrist holds on a self-motion: no member needs less than the answer, or
than the bound.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, JoulepathError, Pose, Problem, Solution, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.optimizer.kinematics.six_joints import KUKA, flange
from tests.selection import long_but

START = np.array([0.0, -1.4, 1.5, 0.2, 0.5, 0.1])
ALIGNED = np.array([0.3, -1.2, 1.4, 0.5, 0.0, -0.4])
# s: no search comes near it, however busy the machine
AMPLE = 300.0
# relative: the least step along a self-motion, 0.002 rad, and the solver's tolerance
REFINED = 1e-3


def answer(goal: Array | Pose) -> Solution:
    return optimize(Problem(arm=Arm(robot=KUKA), start=START, goal=goal, deadline=AMPLE))


@pytest.mark.parametrize("every", long_but((False,), (False, True)))
def test_no_member_needs_less(every: bool) -> None:
    """Three members beside the answer's, or 24 of each position of the arm."""
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
