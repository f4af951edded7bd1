"""An arm of Universal Robots' form is recognised in whatever convention its file is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.six.drawing import DrawnMotion
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.optimizer.kinematics.axis_patterns import UR_AXES, redrawn, robot_of, shifted
from tests.optimizer.kinematics.six_joints import ACCURACY, FOUND, flange, solved

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
        assert any(isinstance(each.self_motion, DrawnMotion) for each in found.branches)
        straight = np.where(np.arange(6) == 2, 0.0, q)
        assert solved(robot, form.drawing.file(straight)).away < FOUND_ON_AN_EDGE
        assert "elbow" in form.singular_parts(form.drawing.file(straight))


def test_the_distance_to_reach_is_that_of_the_arm() -> None:
    """A pose out of reach is as far from it in every drawing, and the nearest position is near."""
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
