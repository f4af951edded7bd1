"""Figures without a source follow the rules stated in their notes, and inertia tensors belong to
arms that can be built.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Robot, load_robot, robot_names
from joulepath.models.capsule_cover import outside
from joulepath.models.meshes import link_surfaces
from joulepath.models.robot import Array
from tests.mesh_folders import FOUND, meshes
from tests.selection import ROBOTS

# relative; the figures have two or three digits
DIGITS = 0.03
COPPER = 0.5  # copper loss times the torque limit [W/(N·m)]
ROTOR = 0.00404  # rotor inertia of a joint with a torque limit of 1 N·m [kg·m²]
COULOMB = 0.06  # Coulomb friction over the torque limit [1]
VISCOUS = 0.055  # viscous friction over the torque limit [s/rad]
RADIUS = 0.0322  # radius of a link at a torque limit of 9 N·m [m]
OF_ONE_MAKER = [name for name in robot_names() if name.startswith("ur")]
LARGEST = ("ur15", "ur20", "ur30")


def robots(section: str, part: str) -> list[str]:
    """Names of the robots with a figure without a source, by one maker: the rules use this maker's
    joints.
    """
    return [
        name for name in OF_ONE_MAKER if load_robot(name).figures[section][part]["trust"] == "E"
    ]


@pytest.mark.parametrize("name", robots("drives", "copper"))
def test_copper_loss_is_that_of_the_rule(name: str) -> None:
    robot = load_robot(name)
    loss = robot.drives.copper / robot.drives.torque_constant**2
    assert loss == pytest.approx(COPPER / robot.limits.tau_max, rel=DIGITS)


@pytest.mark.parametrize("name", LARGEST)
def test_rotors_and_friction_are_those_of_the_rules(name: str) -> None:
    robot = load_robot(name)
    assert robot.drives.rotor_inertia == pytest.approx(
        ROTOR * robot.limits.tau_max**1.243, rel=DIGITS
    )
    assert robot.friction.coulomb == pytest.approx(COULOMB * robot.limits.tau_max, rel=DIGITS)
    assert robot.friction.viscous == pytest.approx(VISCOUS * robot.limits.tau_max, rel=DIGITS)


def test_the_rules_are_the_robots_without_drives_of_their_own() -> None:
    assert tuple(robots("drives", "rotor_inertia")) == LARGEST
    assert tuple(robots("collision", "upper_arm")) == LARGEST


@pytest.mark.parametrize("name", OF_ONE_MAKER)
def test_a_long_link_has_at_least_the_inertia_of_a_rod(name: str) -> None:
    """Joints at both ends, so more mass is outside than a uniform rod has: the tensor of a lighter
    arm would show.
    """
    robot = load_robot(name)
    for link in (2, 3):
        body, length = (
            robot.model.inertias[link],
            np.linalg.norm(robot.model.jointPlacements[link + 1].translation[:2]),
        )
        assert body.inertia[2, 2] > body.mass * length**2 / 12


@pytest.mark.parametrize("name", ROBOTS)
def test_every_tensor_is_that_of_a_body(name: str) -> None:
    """Principal moments are positive, and none exceeds the sum of the others, but for rounding and
    one known fault.
    """
    figures = load_robot(name).figures["inertials"]
    for body in load_robot(name).model.inertias[1:]:
        moments = np.linalg.eigvalsh(body.inertia)
        assert moments[0] > 0
        if moments[2] > moments[0] + moments[1]:
            assert name == "panda" and "triangle" in figures["inertia"]["note"]
            assert moments[2] < 1.1 * (moments[0] + moments[1])


def rings(robot: Robot, joint: int) -> tuple[int, Array]:
    """The link before a joint whose axis meets the previous one, and circles around both axes at
    their intersection [m].
    """
    radii = RADIUS * (robot.limits.tau_max[joint - 1 : joint + 1] / 9) ** 0.241
    angle = np.linspace(0, 2 * np.pi, 72)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    placement = robot.model.jointPlacements[joint + 1]
    # the second circle is in the middle of the joint, on the axis of the first
    return joint, np.concatenate([radii[0] * circle, radii[1] * circle @ placement.rotation.T])


@pytest.mark.parametrize("joint", [1, 4, 5], ids=["shoulder", "wrist 1", "wrist 2"])
@pytest.mark.parametrize("name", LARGEST)
def test_capsules_without_meshes_hold_joints_of_the_size_of_the_rule(name: str, joint: int) -> None:
    robot = load_robot(name)
    link, points = rings(robot, joint)
    capsules = [capsule for capsule in robot.capsules if capsule.link == link]
    assert outside(points, capsules).min(axis=0).max() < 0
    # and are of its order: none is half as large again
    assert max(capsule.radius for capsule in capsules) < 1.5 * np.linalg.norm(points, axis=1).max()


@pytest.mark.parametrize("name", FOUND)
def test_the_rule_of_radii_fits_the_arms_that_it_is_from(name: str) -> None:
    """Half the width of shoulder and wrist 2 across the axes of both of their joints, by the
    maker's meshes.
    """
    limits = load_robot(name).limits
    for link, joint in ((1, 0), (5, 5)):
        half = np.abs(link_surfaces(meshes(name), name, link)["visual"][..., 0]).max()
        rule = RADIUS * (limits.tau_max[joint] / 9) ** 0.241
        # lengths have three digits
        assert 0.999 * half < rule < 1.13 * half
