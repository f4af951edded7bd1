"""Helpers for tests of seven-joint arms with traced self-motions."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.chains import serial_chain

GEN3 = load_robot("gen3")
CHAIN = serial_chain(7)
PANDA = load_robot("panda")


def away(curve: TracedCurve, q: Array) -> float:
    """Distance [rad] of q (7,) from a curve."""
    return float(np.abs(wrapped(curve.at(np.array([curve.parameter(q)]))[0] - q)).max())
