"""Boxes around all configurations of a pose, for seven-joint arms without an exact closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.covers.branch_covers import (
    BranchCover,
    boxes_on,
    branch_covers,
)
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.chains import serial_chain
from tests.selection import long_but

# rounding of a parameter at the end of an arc, and of a joint position at the side of a box [rad]
ROUNDING = 1e-12
# deviation of the Gen3's axes from the closed form [m]
GEN3_OFF = 0.36e-3


def skewed() -> Robot:
    """Panda with axes displaced by some tenths of a millimetre, as after a calibration."""
    robot, rng = load_robot("panda"), np.random.default_rng(5)
    model = robot.model.copy()
    for joint in range(2, 8):
        model.jointPlacements[joint].translation += rng.normal(0.0, 5e-5, 3)
    return replace(robot, model=model)


ROBOTS = {"gen3": load_robot("gen3"), "skewed panda": skewed()}


@pytest.fixture(params=long_but(["gen3"], ROBOTS), scope="module")
def robot(request: pytest.FixtureRequest) -> Robot:
    return ROBOTS[request.param]


def configurations(robot: Robot, count: int, seed: int) -> Array:
    """Random configurations, every other one with some joints at a singularity of the form or next
    to it.
    """
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (count, 7))
    for k in range(0, count, 2):
        joints = rng.choice([1, 3, 5], rng.integers(1, 4), replace=False)
        q[k, joints] = 10.0 ** rng.uniform(-12, -1, len(joints)) * rng.choice([0.0, 1.0, -1.0])
    return q


def holding(sheets: list[BranchCover], q: Array, half: float, shift: float) -> list[float]:
    """Largest sides [rad] of the boxes around q (7,), for the given half side of the parameter."""
    found = []
    for sheet in sheets:
        u = -q[0] if sheet.mirrored else q[6]
        for low, high in sheet.arcs:
            own = float(nearest_turn(np.asarray(u), np.asarray((low + high) / 2)))
            if low - ROUNDING <= own <= high + ROUNDING:
                centre, sides = boxes_on(
                    [sheet], np.array([0]), np.array([own + shift * half]), np.array([half])
                )
                if (np.abs(wrapped(q - centre[0])) <= sides[0] + ROUNDING).all():
                    found.append(float(sides.max()))
    return found


@pytest.mark.parametrize("count", long_but((60,), (60, 3000)))
def test_every_configuration_is_in_a_box_of_its_pose(robot: Robot, count: int) -> None:
    assert RedundantArm.of(robot.model) is None
    chain, rng, widths = Chain.of(robot.model), np.random.default_rng(7), []
    for k, q in enumerate(configurations(robot, count, seed=6)):
        sheets = branch_covers(robot, chain.flange(q[None])[0])
        assert sheets is not None
        for half in (0.0, 1e-4, 1e-2, 0.3, 3.0):
            held = holding(sheets, q, half, float(rng.uniform(-1, 1)))
            assert held, (k, half)
            if half == 0 and k % 2:
                widths.append(min(held))
    # A useful cover of half a millimetre, away from singularities.
    assert np.median(widths) < 0.2


def test_the_deviation_is_reached_and_not_exceeded() -> None:
    """The flanges of the simple arm and of the Gen3 are at most `deviation` apart, and nearly
    so.
    """
    robot = ROBOTS["gen3"]
    chain, rng = Chain.of(robot.model), np.random.default_rng(8)
    sheets = branch_covers(robot, chain.flange(np.zeros((1, 7)))[0])
    assert sheets is not None and sheets[0].mirrored and sheets[0].blur < GEN3_OFF
    form = sheets[0].pose.form
    nearby = Chain(form.placements, form.T_last_flange)
    q = rng.uniform(-np.pi, np.pi, (4000, 7))
    apart = []
    for ours, theirs in zip(chain.flange(q)[::40], nearby.flange(-q[:, ::-1])[::40], strict=True):
        found = branch_covers(robot, ours)
        assert found is not None
        # Position of S in the frame of the last link.
        seen = found[0].pose.shoulder
        apart.append(float(np.linalg.norm(seen - form.shoulder_in_7(theirs))))
    assert 0.9 * sheets[0].blur < max(apart) <= sheets[0].blur + ROUNDING


def test_there_are_none_of_an_arm_that_is_near_no_form() -> None:
    chain = serial_chain(7)
    assert branch_covers(chain, np.eye(4)) is None
    assert branch_covers(load_robot("ur5e"), np.eye(4)) is None


def test_a_pose_out_of_reach_has_none() -> None:
    T = np.eye(4)
    T[2, 3] = 3.0
    assert branch_covers(ROBOTS["gen3"], T) == []
