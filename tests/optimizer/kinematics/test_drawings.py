"""Forms of arms are recognised in any convention of robot files.

Axes may also be only nearly parallel or nearly meet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Robot, SingularPose, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.stretched_wrist import StretchedWrist
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.optimizer.kinematics.axis_patterns import UR_AXES, redrawn, robot_of, shifted
from tests.optimizer.kinematics.six_joints import (
    ACCURACY,
    FOUND,
    KUKA,
    UR5E,
    calibrated,
    flange,
    inside,
    solved,
)
from tests.selection import long_but

# at an edge of the workspace, a rounding of the pose by 1e-16 m moves the joints so far [rad]
FOUND_ON_AN_EDGE = 2e-6


def form_of(axes: JointAxes) -> URClosedForm:
    return URClosedForm.of(robot_of(axes).model) or pytest.fail("the arm is not recognised")


@pytest.mark.parametrize("name", ["ur3e", "ur5e", "ur10e"])
def test_the_makers_convention_is_that_of_the_form(name: str) -> None:
    form = URClosedForm.of(load_robot(name).model)
    assert form is not None and form.a1 == form.tilt == 0
    drawing = form.drawing
    assert (drawing.senses == 1).all() and (drawing.zeros == 0).all()
    assert (drawing.T_form_base == np.eye(4)).all() and (drawing.T_flange_form == np.eye(4)).all()


@pytest.mark.parametrize("axes", [UR_AXES, shifted(0.07, 0.0), shifted(-0.05, 0.04)])
def test_every_configuration_is_found_in_every_drawing(axes: JointAxes) -> None:
    rng, form = np.random.default_rng(11), form_of(axes)
    for _ in range(10):
        other, senses, zeros = redrawn(axes, rng)
        robot, drawn = robot_of(other), form_of(other)
        assert required_inverse_kinematics(robot, "goal").complete
        assert lengths(drawn) == pytest.approx(lengths(form), abs=1e-12)
        for _ in range(5):
            q = rng.uniform(-np.pi, np.pi, 6)
            assert drawn.label(senses * q + zeros) == form.label(q)
            assert drawn.ahead(senses * q + zeros) == pytest.approx(form.ahead(q), abs=1e-12)
            found = solved(robot, senses * q + zeros)
            assert found.away < FOUND and found.error < ACCURACY and not found.twice
            assert len(found.branches) == len(solved(robot_of(axes), q).branches)


@pytest.mark.parametrize("axes", [UR_AXES, shifted(-0.05, 0.04)])
def test_singular_configurations_are_found_in_every_drawing(axes: JointAxes) -> None:
    rng = np.random.default_rng(12)
    for _ in range(10):
        other = redrawn(axes, rng)[0]
        form, robot = form_of(other), robot_of(other)
        q = rng.uniform(-np.pi, np.pi, 6)
        stretched = np.where(np.arange(6) == 4, rng.choice([0.0, np.pi]), q)
        found = solved(robot, form.drawing.file(stretched))
        assert found.away < FOUND and found.error < ACCURACY
        assert any(isinstance(each.self_motion, StretchedWrist) for each in found.branches)
        straight = np.where(np.arange(6) == 2, 0.0, q)
        assert solved(robot, form.drawing.file(straight)).away < FOUND_ON_AN_EDGE
        assert "elbow" in form.singular_parts(form.drawing.file(straight))


def test_the_distance_to_reach_is_that_of_the_arm() -> None:
    """The distance to reach is the same in every drawing of an arm.

    Poses moved by slightly more than the distance are reached in some direction, others are not.
    """
    rng, axes = np.random.default_rng(13), shifted(-0.05, 0.04)
    form, T = form_of(axes), flange(robot_of(axes), rng.uniform(-1, 1, 6))
    T[:3, 3] *= 1.5 / np.linalg.norm(T[:3, 3])
    far = form.distance_to_reach(T)
    for _ in range(4):
        assert form_of(redrawn(axes, rng)[0]).distance_to_reach(T) == pytest.approx(far, abs=1e-9)
    directions = _sphere(2000, rng)
    for factor, is_reached in ((1.05, True), (0.999, False)):
        found = (form.solve(_shifted(T, factor * far * each))[0] for each in directions)
        assert any(len(each) for each in found) == is_reached


def lengths(form: URClosedForm) -> list[float]:
    names = ("d1", "a1", "a2", "a3", "d4", "d5", "d6", "tilt")
    return [getattr(form, name) for name in names]


def _sphere(count: int, rng: np.random.Generator) -> Array:
    v = rng.normal(size=(count, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1)[:, None])


def _shifted(T: Array, by: Array) -> Array:
    moved = T.copy()
    moved[:3, 3] += by
    return moved


# deviation of the joints' frames, as of a factory calibration [m, rad]
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


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3])
def test_a_calibrated_wrist_has_no_self_motion_but_single_configurations(off: float) -> None:
    """A calibrated wrist has single configurations in place of a self-motion.

    At poses with an aligned nominal wrist, these lie along the curve of the nominal self-motion.
    """
    arm, rng = calibrated(KUKA, OFF), np.random.default_rng(23)
    for _ in range(4):
        q = inside(arm, rng)
        q[4] = off
        found = solved(arm, q)
        assert found.away < FOUND and found.error < ACCURACY and not found.twice
        assert all(each.self_motion is None for each in found.branches)


def skewed() -> Robot:
    """Spherical wrist on a base with a second axis oblique to the first, without branch names."""
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
