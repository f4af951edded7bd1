"""The same arm, drawn in other conventions or with rounded figures, has the same answers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from joulepath.models.own_arm.description import Description
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.robot import Robot
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.models.own_arm.arms import robot
from tests.models.own_arm.drawings import Convention, drawn, inclined, right_angled
from tests.optimizer.kinematics.six_joints import KUKA, UR5E, flange
from tests.selection import long_but

FIGURES = (repr, "{:.9f}".format, "{:.4f}".format, "{:.3f}".format)
AS_GIVEN = Convention(np.ones(6), np.zeros(6), np.tile(np.eye(3), (7, 1, 1)))


def described(urdf: str) -> Description:
    return Description(urdf=urdf, tip="link_7", acceleration=8.0, payload=2.0)


@pytest.mark.parametrize("arm", [UR5E, KUKA], ids=lambda each: each.name)
@pytest.mark.parametrize(
    "figure",
    long_but(FIGURES[2:3], FIGURES),
)
def test_rounded_figures_are_the_arm_that_they_stand_for(
    arm: Robot, figure: Callable[[float], str]
) -> None:
    rng = np.random.default_rng(22)
    for drawing in (right_angled, inclined):
        convention = drawing(6, rng)
        made = robot(described(drawn(arm, convention, figure)))
        assert required_inverse_kinematics(made, "goal").complete
        q = rng.uniform(-2, 2, 6)
        assert flange(made, convention.file(q)) == pytest.approx(flange(arm, q), abs=1e-9)


@pytest.mark.parametrize(
    ("written", "degrees"),
    [
        ("1.571", 90),
        ("-1.5707", -90),
        ("3.1416", 180),
        ("3.14159", 180),
        ("4.712", 270),
        ("1.5707963", 90),
        ("0.7854", 45),
        ("-0.262", -15),
        ("1.047198", 60),
    ],
)
def test_a_rounded_angle_is_taken_as_meant(written: str, degrees: int) -> None:
    exact = robot(described(_first_turned(repr(float(np.radians(degrees))))))
    rounded = robot(described(_first_turned(written)))
    q = np.linspace(-1, 1, 6)
    assert flange(rounded, q) == pytest.approx(flange(exact, q), abs=1e-14)


@pytest.mark.parametrize("length", [1e-320, 1e-200, 2.0, 1e200])
def test_an_axis_of_any_length_is_a_direction(length: float) -> None:
    """Even if its square underflows or overflows."""
    drawing = drawn(UR5E, AS_GIVEN)
    assert 'xyz="0.0 0.0 1.0"' in drawing
    longer = robot(described(drawing.replace('xyz="0.0 0.0 1.0"', f'xyz="0 0 {length!r}"')))
    q = np.linspace(-1, 1, 6)
    assert flange(longer, q) == pytest.approx(flange(robot(described(drawing)), q), abs=1e-14)


@pytest.mark.parametrize(
    "written", ["1.5709", "1.57", "0.001", "1.5702", "3.14", "0.79", "0.7851", "1e308"]
)
def test_another_angle_stays_as_it_is(written: str) -> None:
    turned = robot(described(_first_turned(written)))
    straight = robot(described(_first_turned("0")))
    T = flange(turned, np.zeros(6)) @ np.linalg.inv(flange(straight, np.zeros(6)))
    angle = float(written)
    expected = np.arctan2(np.sin(angle), np.cos(angle))
    assert np.arctan2(T[1, 0], T[0, 0]) == pytest.approx(expected, abs=1e-12)


def test_the_description_says_which_angles_were_rounded() -> None:
    for written, told in (("1.571", True), ("1.5707963", False), ("0.3", False)):
        warnings = own_figures("mine", described(_first_turned(written)))[1]
        assert any("written with few decimals" in each for each in warnings) == told


@pytest.mark.parametrize(
    ("written", "told"),
    [("1.57", True), ("-3.14", True), ("0.00", False), ("1.571", False), ("1.2", False)],
)
def test_a_quarter_turn_with_two_decimals_is_remarked(written: str, told: bool) -> None:
    warnings = own_figures("mine", described(_first_turned(written)))[1]
    assert any("angles of 1.57 or 3.14: joint_1" in each for each in warnings) == told


def _first_turned(yaw: str) -> str:
    """UR5e on a base turned about the vertical by a written angle."""
    return drawn(UR5E, AS_GIVEN).replace('rpy="0.0 -0.0 0.0"', f'rpy="0 0 {yaw}"', 1)
