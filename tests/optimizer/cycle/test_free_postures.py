"""Cycles with free postures at stops, for redundant or singular arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Cycle, Pose, Stop, load_robot, plan_cycle
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.held_pose import HELD_POSE, HeldPose
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.optimizer.cycle.test_optimize_cycle import planned
from tests.optimizer.moves import AMPLE
from tests.selection import long_but

# rad: a step along the curve; relative: difference between solves of the same motion
STEP = 0.1
AGREED = 2e-3
POSTURES = {
    # the fifth joint is stretched at both stops
    "ur5e": [
        [0.4, -1.4, 1.6, -1.2, -1.5, 0.3],
        [1.1, -1.0, 1.3, -0.8, 0.0, 0.6],
        [-0.5, -1.6, 1.9, -1.1, 0.0, -0.4],
    ],
    "panda": [
        [0.27, -0.36, 0.18, -1.8, 0.09, 1.62, 0.45],
        [0.9, 0.3, -0.4, -1.6, 0.5, 2.1, -0.3],
        [-0.6, 0.2, 0.1, -1.7, -0.2, 2.0, 0.9],
    ],
}


def cycle_of(robot: str) -> tuple[Cycle, Array]:
    """A closed cycle from one posture over the poses of others, and these other postures."""
    arm, (start, *q) = Arm(robot=load_robot(robot), collisions=False), np.array(POSTURES[robot])
    stops = [Stop(name=str(k), target=Pose(tcp_pose(arm, each))) for k, each in enumerate(q)]
    return Cycle(arm=arm, start=start, stops=stops, windings=False, deadline=AMPLE), np.array(q)


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "stops"), long_but([("ur5e", 1)], [("ur5e", 1), ("ur5e", 2), ("panda", 2)])
)
def test_no_posture_beside_those_of_a_cycle_needs_less(robot: str, stops: int) -> None:
    asked, _ = cycle_of(robot)
    found = planned(asked)
    assert found.status == "feasible"
    least, at = found.energy.electrical.total, [move.solution.goal.q for move in found.moves[:-1]]
    assert [move.solution.goal.target for move in found.moves] == [0, 0, 0]
    for k, q in enumerate(at[:stops]):
        curve = HeldPose.of(asked.arm, q)
        assert curve.moves(q)
        for step in (STEP, -STEP):
            beside = curve.put(q + step * curve.tangent(q))
            if beside is None:
                continue
            targets = [beside if other == k else each for other, each in enumerate(at)]
            moved = [
                replace(stop, target=each) for stop, each in zip(asked.stops, targets, strict=True)
            ]
            assert (
                plan_cycle(replace(asked, stops=moved)).energy.electrical.total
                > (1 - AGREED) * least
            )


@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_the_pose_is_held_along_the_curve(robot: str) -> None:
    asked, q = cycle_of(robot)
    for each in q:
        curve = HeldPose.of(asked.arm, each)
        moved = curve.put(each + STEP * curve.tangent(each))
        assert moved is not None and np.abs(moved - each).max() > STEP / 4
        assert (
            np.abs(tcp_pose(asked.arm, moved) - tcp_pose(asked.arm, each)).max()
            < 10 * HELD_POSE.tolerance
        )


def test_an_arm_that_is_not_singular_has_no_curve() -> None:
    asked, q = cycle_of("ur5e")
    bent = q[0] + np.array([0, 0, 0, 0, 0.01, 0])
    assert not HeldPose.of(asked.arm, bent).moves(bent)
