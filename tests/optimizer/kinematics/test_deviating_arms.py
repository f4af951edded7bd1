"""Arms whose axes meet or are parallel only nearly: calibrated arms, and descriptions with rounded
angles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Robot, SingularPose
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.optimizer.kinematics.six_joints import (
    ACCURACY,
    FOUND,
    KUKA,
    UR5E,
    calibrated,
    inside,
    solved,
)
from tests.selection import long_but

# deviation of each joint's frame, as of a factory calibration [m, rad]
OFF = 1e-4


@pytest.mark.parametrize("count", long_but((25,), (25, 400)))
@pytest.mark.parametrize("robot", [KUKA, UR5E], ids=lambda robot: robot.name)
def test_every_configuration_of_a_calibrated_arm_is_found(robot: Robot, count: int) -> None:
    arm, nominal = calibrated(robot, OFF), required_inverse_kinematics(robot, "goal")
    inverse, rng = required_inverse_kinematics(arm, "goal"), np.random.default_rng(21)
    assert URClosedForm.of(arm.model) is None and isinstance(
        DecomposedArm.of(arm.model), DecomposedArm
    )
    assert not inverse.complete, (
        "next to a singularity it may have branches that the simplest arm has not"
    )
    for _ in range(count):
        q = inside(arm, rng)
        found = solved(arm, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        assert inverse.label(q) == nominal.label(q)


def test_rounded_angles_are_no_hindrance() -> None:
    """Quarter turns written as 1.5708: the axes are no longer parallel, and none meet."""
    model = KUKA.model.copy()
    for j in range(1, 7):
        M = model.jointPlacements[j]
        model.jointPlacements[j] = pin.SE3(
            pin.rpy.rpyToMatrix(np.round(pin.rpy.matrixToRpy(M.rotation), 4)), M.translation
        )
    arm, rng = replace(KUKA, model=model), np.random.default_rng(22)
    assert isinstance(DecomposedArm.of(model), DecomposedArm)
    for _ in range(20):
        found = solved(arm, inside(arm, rng))
        assert found.away < FOUND and found.error < ACCURACY and not found.twice


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3])
def test_a_calibrated_wrist_has_no_self_motion_but_single_configurations(off: float) -> None:
    """At poses with an aligned nominal wrist, they lie along the curve of its self-motion."""
    arm, rng = calibrated(KUKA, OFF), np.random.default_rng(23)
    for _ in range(4):
        q = inside(arm, rng)
        q[4] = off
        found = solved(arm, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        assert all(each.self_motion is None for each in found.branches)


def skewed() -> Robot:
    """Spherical wrist on a base with a second axis oblique to the first: its branches have no
    names.
    """
    model = KUKA.model.copy()
    M = model.jointPlacements[2]
    model.jointPlacements[2] = pin.SE3(
        M.rotation @ pin.rpy.rpyToMatrix(0.3, 0.2, 0.0), M.translation
    )
    return replace(KUKA, model=model)


def test_branches_without_names_are_numbered() -> None:
    arm, rng = skewed(), np.random.default_rng(24)
    inverse = required_inverse_kinematics(arm, "goal")
    assert not inverse.complete
    for _ in range(20):
        q = inside(arm, rng)
        found = solved(arm, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        assert [str(each.label) for each in found.branches] == [
            f"branch {k + 1}" for k in range(len(found.branches))
        ]
        own = min(found.branches, key=lambda each: np.abs(np.sin((each.q - q) / 2)).max())
        assert inverse.label(q) == own.label


def test_a_self_motion_of_an_arm_without_names_is_refused() -> None:
    arm, rng = skewed(), np.random.default_rng(25)
    for _ in range(5):
        q = inside(arm, rng)
        q[4] = 0.0
        with pytest.raises(SingularPose):
            solved(arm, q)
        # Joint positions need no branch.
        assert str(required_inverse_kinematics(arm, "goal").label(q)) == "branch 1"
