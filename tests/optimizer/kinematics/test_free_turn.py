"""Seven-joint arms with a spherical shoulder at singularities with freely turning joints."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Robot, load_robot
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.seven.free_turn import SETTINGS, FreeTurn
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from tests.optimizer.kinematics.seven_joints import (
    ACCURACY,
    FOUND,
    ROBOTS,
    away,
    closed_form,
    configurations,
    flange,
)
from tests.selection import long_but

# uncertainty of angles next to a singularity times the distance from it, for a pose rounded to
# double precision [rad²]; larger for the xArm, due to a nearly folded elbow
ROUNDED = {"panda": 1e-14, "iiwa14": 1e-14, "xarm7": 3e-14}
# configurations [rad] beside a singularity and slightly off every curve; the first arm is stretched
# up to 5.7e-6 rad
MISSED = {
    "iiwa14": [
        0.176878052873,
        1.549884477646,
        1.813836506031,
        5.7100475841e-06,
        -1.585568033,
        -2.064212006,
        -1.45936,
    ],
    "xarm7": [
        1.869737766969,
        1.645766846285,
        -5.183812248058,
        3.227667832408,
        -4.526748147774,
        2.976476879399,
        1.909424661851,
    ],
}
# largest distance of these configurations from the nearest curve [rad]
NEARLY_FOUND = 1e-5


@pytest.fixture(params=ROBOTS, scope="module")
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


@pytest.fixture(scope="module")
def arm(robot: Robot) -> RedundantArm:
    return closed_form(robot)


@pytest.mark.parametrize("joint", [1, 3, 5])
@pytest.mark.parametrize(
    "off", long_but([0.0, 1e-8, 1e-5], [0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3])
)
def test_a_pose_on_a_singularity_or_next_to_it_is_reached(
    robot: Robot, arm: RedundantArm, joint: int, off: float
) -> None:
    """The solver reaches poses on a singularity and next to it.

    The first and third axis are in line, the arm is stretched, or the wrist is aligned.
    """
    for q in configurations(robot, 5, seed=47):
        q[joint] = np.clip(off, robot.limits.q_min[joint], robot.limits.q_max[joint])
        T = flange(robot, q)
        solutions = required_inverse_kinematics(robot, "goal").solve(T)
        assert max(np.abs(flange(robot, each.q) - T).max() for each in solutions) < ACCURACY
        if joint == 3 and robot.name == "iiwa14":
            # A nearly stretched arm holds its pose on very small loops, hidden by rounding.
            curves = arm.self_motions(T, robot.limits)
            assert away(curves, q) < SETTINGS.loop_half_width
            inside = []
            for curve in curves:
                centre, sides = curve.boxes(np.array([curve.parameter(q)]), np.array([1e-6]))
                inside.append((np.abs(wrapped(q - centre[0])) <= sides[0]).all())
            assert any(inside)
            continue
        assert away(arm.self_motions(T, robot.limits), q) < max(
            FOUND, 0.0 if off == 0 else ROUNDED[robot.name] / off
        )


@pytest.mark.parametrize(
    ("joint", "step"), [(1, [1.0, 0, -1.0, 0, 0, 0, 0]), (3, [0, 0, 1.0, 0, -1.0, 0, 0])]
)
def test_a_free_turn_on_a_singularity_is_a_curve(joint: int, step: list[float]) -> None:
    """The free turn of a singular arm is a self-motion.

    The first and the third axis are in line, or the third and the fifth of a stretched iiwa.
    """
    rng = np.random.default_rng(51)
    for name in ("iiwa14", "panda") if joint == 1 else ("iiwa14",):
        robot = load_robot(name)
        arm = closed_form(robot)
        for q in configurations(robot, 10, seed=49):
            q[joint] = 0.0
            T = flange(robot, q)
            turned = q + rng.uniform(-2, 2) * np.array(step)
            curves = arm.self_motions(T)
            assert away(curves, turned) < FOUND
            for curve in curves:
                if isinstance(curve, FreeTurn):
                    u = rng.uniform(-np.pi, np.pi, 4)
                    centre, sides = curve.boxes(u, np.full(4, 0.1))
                    for k in range(4):
                        members = curve.at(u[k] + np.linspace(-0.1, 0.1, 9))
                        assert (np.abs(wrapped(members - centre[k])) <= sides[k]).all()
                        assert (
                            max(np.abs(flange(robot, each) - T).max() for each in members)
                            < ACCURACY
                        )


def test_limits_keep_free_turns_within_them() -> None:
    """With the first and third axis in line, only curves near this singularity are searched."""
    rng = np.random.default_rng(52)
    for name in ("iiwa14", "panda", "xarm7"):
        robot = load_robot(name)
        arm = closed_form(robot)
        for q in configurations(robot, 10, seed=53):
            q[1], most = 0.0, np.minimum(robot.limits.q_max, np.pi)[[0, 2]]
            # Both angles stay within the symmetric limits.
            turned = q + rng.uniform(-1, 1) * (most - np.abs(q[[0, 2]])).min() * np.array(
                [1.0, 0, -1.0, 0, 0, 0, 0]
            )
            assert away(arm.self_motions(flange(robot, q), robot.limits), turned) < FOUND


def test_boxes_hold_the_configurations_of_a_free_turn(robot: Robot, arm: RedundantArm) -> None:
    """Boxes around a curve also cover the configurations of a free turn on its singularity.

    With the first and third axis in line, both joints turn against each other at a constant last
    angle. Curves over the last angle do not contain such turns, but the box around the point does.
    """
    rng = np.random.default_rng(48)
    for q in configurations(robot, 10, seed=49):
        q[1] = 0.0
        T = flange(robot, q)
        turned = q + rng.uniform(-2, 2) * np.array([1.0, 0, -1.0, 0, 0, 0, 0])
        assert np.abs(flange(robot, turned) - T).max() < ACCURACY
        held = False
        for curve in arm.self_motions(T):
            if isinstance(curve, FreeTurn):
                continue
            # Parameter with the last angle of q.
            u = np.linspace(*curve.arcs[0], 20_001)
            u = u[[np.abs(wrapped(curve.last_angle(u) - q[6])).argmin()]]
            centre, sides = curve.boxes(u, np.array([2e-4]))
            held |= bool((np.abs(wrapped(turned - centre[0])) <= sides[0]).all())
        assert held


@pytest.mark.parametrize("name", MISSED)
def test_configurations_known_to_be_missed_are_nearly_found(name: str) -> None:
    robot, q = load_robot(name), np.array(MISSED[name])
    answers = required_inverse_kinematics(robot, "goal").solve(flange(robot, q))
    curves = list(dict.fromkeys(each.self_motion for each in answers))
    assert FOUND < away(curves, q) < NEARLY_FOUND  # type: ignore[arg-type]
