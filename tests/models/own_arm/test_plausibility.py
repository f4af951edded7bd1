"""Figures in other units and placeholders cause one warning each, with the likely cause."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath.models.own_arm.description import Description, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.holding_torques import HoldingTorques
from joulepath.models.own_arm.urdf_chain import chain_of
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.problem.robots import load_robot
from tests.models.own_arm.arms import PLAIN, RICH, RICH_ARM, robot
from tests.selection import ROBOTS

CAUSES = (
    "is implausible",
    "likely a placeholder",
    "cannot hold",
    "is it a placeholder",
    "centre of mass is",
)


def test_joints_that_turn_about_one_line() -> None:
    """Like a file with an axis lost by its exporter."""
    lost = RICH.replace(
        '<origin xyz="0.05 0 0.3" rpy="1.5707963267948966 0.3 0"/><axis xyz="1 1 0.5"/>',
        '<origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>',
    )
    assert lost != RICH
    found = own_figures("mine", replace(RICH_ARM, urdf=lost))[1]
    assert any(each.startswith("Joints 'pan' and 'elbow' turn about one line") for each in found)
    assert not any("one line" in each for each in own_figures("mine", RICH_ARM)[1])


def doubts(description: Description) -> list[str]:
    """Warnings about units and placeholders."""
    warnings = own_figures("mine", description)[1]
    return [each for each in warnings if any(cause in each for cause in CAUSES)]


def changed(old: str, new: str) -> Description:
    assert old in PLAIN.urdf
    return replace(PLAIN, urdf=PLAIN.urdf.replace(old, new, 1))


# identified together: single torques do not separate these inertias
IDENTIFIED_INERTIAS = {"panda": ("link1", "link5")}


@pytest.mark.parametrize("name", ROBOTS)
def test_a_known_arm_is_plausible(name: str) -> None:
    known = load_robot(name)
    description = Description(
        urdf=urdf_of(name, known.figures),
        tip="flange",
        acceleration=tuple(known.limits.a_max.tolist()),
        payload=known.rated_payload,
    )
    found = doubts(description)
    assert len(found) == len(doubted := IDENTIFIED_INERTIAS.get(name, ()))
    assert all(
        f"Link {link!r}: an inertia" in text for link, text in zip(doubted, found, strict=True)
    )


@pytest.mark.parametrize(
    ("description", "told"),
    [
        (changed('velocity="3"', 'velocity="180"'), "'shoulder': a speed limit of 180 rad/s"),
        (replace(PLAIN, acceleration=800.0), "'shoulder': an acceleration limit of 800 rad/s²"),
        (changed('upper="2.5"', 'upper="90"'), "'elbow': a position limit of 90 rad"),
        (changed('mass value="3"', 'mass value="3000"'), "'upper_arm': a mass of 3000 kg"),
        (replace(PLAIN, payload=2000.0), "payload: a mass of 2000 kg"),
        (changed('xyz="0 0 0.4"', 'xyz="0 0 8"'), "'upper_arm': a distance to the next joint"),
        (changed('xyz="0 0 0.15"', 'xyz="0 0 15"'), "'forearm': its centre of mass is 15 m"),
        (
            changed('ixx="0.016" ixy="0" ixz="0" iyy="0.016"', 'ixx="2" ixy="0" ixz="0" iyy="2"'),
            "'forearm': an inertia of 2 kg·m² for 2 kg",
        ),
    ],
)
def test_a_figure_in_another_unit_is_named(description: Description, told: str) -> None:
    found = doubts(description)
    assert any(told in each for each in found), found
    assert not any(told in each for each in doubts(PLAIN))


@pytest.mark.parametrize(
    ("description", "message"),
    [
        (changed('xyz="0 0 0.15"', 'xyz="0 0 150"'), "'forearm' must be lighter"),
        (changed('upper="2.5"', 'upper="150"'), "'elbow' has a position limit of 150 rad"),
    ],
)
def test_what_nothing_real_is_like_is_refused(description: Description, message: str) -> None:
    with pytest.raises(InvalidArm, match=message):
        own_figures("mine", description)


def test_an_effort_that_cannot_hold_the_arm_is_named() -> None:
    (found,) = doubts(changed('effort="40"', 'effort="1"'))
    # 2 kg at 0.15 m
    assert "'elbow' cannot hold" in found and "up to 2.94 N·m" in found and "is 1 N·m" in found


def test_placeholder_efforts_are_named_and_rule_nothing() -> None:
    efforts: Any = (1000.0, 1000.0)
    arm = replace(PLAIN, torque=efforts)
    assert [each.split()[1] for each in doubts(arm)] == ["'shoulder'", "'elbow'"]
    made, needed = robot(arm), HoldingTorques.of(chain_of(PLAIN), np.array([8.0, 8.0]), 2.0).needed
    assert made.limits.tau_max.tolist() == [1000.0, 1000.0]
    assert made.drives.rotor_inertia == pytest.approx(0.0117 * 2 * needed)
    assert made.friction.coulomb == pytest.approx(0.06 * 2 * needed)
    assert made.friction.viscous == pytest.approx(0.055 * 2 * needed)


def test_the_torques_are_those_of_the_stretched_arm() -> None:
    """Level, both links and the payload pull down; the tip is 0.7 m from the shoulder."""
    torques = HoldingTorques.of(chain_of(PLAIN), np.zeros(2), 2.0)
    shoulder, elbow = 9.81 * (3 * 0.2 + 2 * 0.55), 9.81 * 2 * 0.15
    assert torques.holding == pytest.approx([shoulder, elbow], rel=0.02)
    loaded = [shoulder + 9.81 * 2 * 0.7, elbow + 9.81 * 2 * 0.3]
    assert torques.needed == pytest.approx(loaded, rel=0.02)
    moving = HoldingTorques.of(chain_of(PLAIN), np.array([0.0, 8.0]), 2.0).needed
    # inertia of forearm and payload about the elbow
    inertia = 0.016 + 2 * 0.15**2 + 2 * 0.3**2
    assert moving[1] == pytest.approx(loaded[1] + 8 * inertia, rel=0.02)
