"""Helpers for tests of seven-joint arms with a spherical shoulder."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.free_turn import FreeTurn
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve
from tests.by_pinocchio import flange as flange
from tests.selection import long_but

ROBOTS = long_but(["panda"], ["panda", "iiwa14", "xarm7"])

# largest pose error of a member of a curve [m, rad]
ACCURACY = 1e-9
# largest distance of a configuration from its curve [rad]
FOUND = 1e-6


def closed_form(robot: Robot) -> RedundantArm:
    found = RedundantArm.of(robot.model)
    assert found is not None
    return found


def configurations(robot: Robot, count: int, seed: int = 41) -> Array:
    return np.random.default_rng(seed).uniform(robot.limits.q_min, robot.limits.q_max, (count, 7))


def away(curves: Sequence[RedundantCurve | FreeTurn], q: Array) -> float:
    """Distance [rad] of q (7,) from the nearest curve."""
    return min(
        float(np.abs(wrapped(each.at(np.array([each.parameter(q)]))[0] - q)).max(initial=0.0))
        for each in curves
    )
