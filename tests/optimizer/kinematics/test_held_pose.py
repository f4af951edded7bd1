"""Self-motions of a held pose: projected configurations hold it within the limits, and the curves
bend as computed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.tcp import tcp_pose

# largest pose error [m, rad]
HELD = 1e-9
# relative error of differences with steps of 1e-3
DIFFERENCES = 1e-2


def curve_of(name: str, seed: int) -> tuple[HeldPose, Array]:
    """Curve through a random configuration in the middle of the joint ranges, and this
    configuration.
    """
    robot = load_robot(name)
    limits, rng = robot.limits, np.random.default_rng(seed)
    q = limits.q_min + rng.uniform(0.3, 0.7, robot.nq) * (limits.q_max - limits.q_min)
    return HeldPose.of(Arm(robot=robot), q), q


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7", "gen3"])
def test_what_is_put_on_the_curve_holds_the_pose(name: str) -> None:
    for seed in range(5):
        curve, q = curve_of(name, seed)
        on_it = curve.put(q)
        assert on_it is not None and np.abs(on_it - q).max() < HELD
        away = q + 0.1 * curve.tangent(q)
        found = curve.put(away)
        assert found is not None
        assert np.abs(tcp_pose(Arm(robot=load_robot(name)), found) - curve.T).max() < HELD
        # The projection returns across the curve, not along it.
        assert np.abs(found - q).max() > 0.5 * np.abs(away - q).max()


def test_a_joint_that_would_leave_its_range_stays_on_its_limit() -> None:
    curve, q = curve_of("panda", 1)
    tangent = curve.tangent(q)
    joint = int(np.abs(tangent).argmax())
    beyond = q + 0.2 * tangent * np.sign(tangent[joint])
    narrow = replace(
        curve, q_max=np.where(np.arange(7) == joint, q + 0.1 * abs(tangent[joint]), curve.q_max)
    )
    found = narrow.put(beyond)
    assert found is not None
    assert found[joint] == pytest.approx(narrow.q_max[joint], abs=HELD)
    assert np.abs(tcp_pose(Arm(robot=load_robot("panda")), found) - curve.T).max() < HELD


def test_an_unreachable_pose_is_held_nowhere() -> None:
    curve, q = curve_of("panda", 2)
    far = curve.T.copy()
    far[:3, 3] *= 5.0
    assert replace(curve, T=far).put(q) is None


@pytest.mark.parametrize("name", ["panda", "gen3"])
def test_tangent_and_bend_are_those_of_the_curve(name: str) -> None:
    h = 1e-3
    for seed in range(5):
        curve, q = curve_of(name, seed)
        tangent = curve.tangent(q)
        after, before = curve.put(q + h * tangent), curve.put(q - h * tangent)
        assert after is not None and before is not None
        assert (after - before) / (2 * h) == pytest.approx(tangent, abs=DIFFERENCES)
        bend, seen = curve.bend(q, tangent), (after + before - 2 * q) / (h * h)
        assert seen == pytest.approx(bend, abs=DIFFERENCES * max(1.0, float(np.abs(bend).max())))
        assert abs(float(bend @ tangent)) < 1e-6 * max(1.0, float(np.abs(bend).max()))
