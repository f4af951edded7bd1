"""The example move of an arm: at ease, without collisions, and within the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.own_arm.description import Description
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Array, LinkCapsule, Robot
from joulepath.optimizer.collision.example_move import EXAMPLE, example_move
from joulepath.optimizer.problem.robots import load_robot
from tests.by_pinocchio import flange
from tests.selection import ROBOTS

ROUNDING = 1e-9
"""Of a direction and a position limit: double precision, over eight turns."""
UNEVEN = 0.01
"""Difference of the two angles between the flange and straight down [rad]: some makers' frames are
turned by a rounded right angle."""
LEAST = 0.05
"""Least singular value of the Jacobian [1], with lengths over that of the arm: not singular."""


def arm(xml: str) -> Robot:
    figures, _ = own_figures("own", Description(urdf=xml, tip="tip", acceleration=5.0, payload=1.0))
    return own_robot("own", figures)


def chain(*axes: str) -> Robot:
    """An arm of links of 0.3 m one upon the other."""
    links = "".join(
        f"""<link name="l{k}"><inertial><origin xyz="0 0 0.15"/><mass value="1"/>
        <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
        <collision><origin xyz="0 0 0.15"/><geometry><cylinder radius="0.02" length="0.2"/>
        </geometry></collision></link>"""
        for k in range(len(axes) + 1)
    )
    joints = "".join(
        f"""<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>
        <origin xyz="0 0 0.3"/><axis xyz="{axis}"/>
        <limit lower="-3" upper="3" velocity="2" effort="200"/></joint>"""
        for k, axis in enumerate(axes)
    )
    tip = f"""<joint name="t" type="fixed"><parent link="l{len(axes)}"/><child link="tip"/>
    <origin xyz="0 0 0.3"/></joint><link name="tip"/>"""
    return arm(f'<robot name="own">{links}{joints}{tip}</robot>')


def jacobian(robot: Robot, q: Array) -> Array:
    """Of the flange (6, nq), with lengths over the sum of those between the joints."""
    data = robot.model.createData()
    frame = robot.model.getFrameId("flange", pin.BODY)
    J = pin.computeFrameJacobian(robot.model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
    lengths = [np.linalg.norm(each.translation) for each in robot.model.jointPlacements]
    J[:3] /= sum(lengths)
    return J


@pytest.mark.parametrize("name", ROBOTS)
def test_each_robot_begins_at_ease(name: str) -> None:
    robot = load_robot(name)
    move = example_move(robot)
    assert move is not None
    low, high = robot.limits.q_min, robot.limits.q_max
    for q in (move.start, move.goal):
        assert (low - ROUNDING <= q).all()
        assert (q <= high + ROUNDING).all()
        T = flange(robot, q)
        assert T[2, 2] == pytest.approx(-1, abs=UNEVEN)
        assert T[2, 3] > 0  # above the floor on which it stands
        assert np.linalg.svd(jacobian(robot, q), compute_uv=False)[-1] > LEAST
    assert np.abs(move.goal - move.start).tolist() == pytest.approx(
        [EXAMPLE.turn, *[0] * (robot.nq - 1)]
    )


def test_an_own_arm_of_any_length_has_one() -> None:
    turn, nod = "0 0 1", "0 1 0"
    for axes in ([turn], [nod, nod], [turn, nod, nod, turn, nod, turn], [turn, nod] * 4):
        robot = chain(*axes)
        move = example_move(robot)
        assert move is not None
        assert move.start.shape == move.goal.shape == (len(axes),)
        assert (robot.limits.q_min <= move.start).all()
        assert (move.goal <= robot.limits.q_max).all()


def test_an_arm_whose_links_always_overlap_has_none() -> None:
    axis = np.array([[0, 0, 0.05], [0, 0, 0.25]])
    capsules = tuple(LinkCapsule(link, axis, radius=2.0) for link in range(4))
    thick = replace(
        chain("0 0 1", "0 1 0", "0 1 0"),
        capsules=capsules,
        hulls=(),
        hulls_between_links=False,
        never_in_collision=frozenset(),
    )
    assert example_move(thick) is None
