"""Helpers for tests of the UR5e's inverse kinematics: its flange by Pinocchio, and tolerances."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.optimizer.moves import ROBOT

IK = required_inverse_kinematics(ROBOT, "goal")
MODEL = ROBOT.model
DATA = ROBOT.model.createData()
FLANGE = MODEL.getFrameId("flange")
LIMITS = ROBOT.limits

# promised accuracy of a solution's forward kinematics [m, rad]
ACCURACY = 1e-9
# promised accuracy of a configuration found again [rad]
FOUND = 1e-6
# rounding in double precision, and the largest part of an angle clipped at a limit [m, turns]
ROUNDING = 1e-10

EVERYDAY = np.array([0.3, -1.6, 1.9, -1.8, -1.5, 0.2])


def forward(q: Array) -> Array:
    pin.framesForwardKinematics(MODEL, DATA, q)
    return np.array(DATA.oMf[FLANGE].homogeneous)


def jacobian(q: Array) -> Array:
    return np.array(pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL_WORLD_ALIGNED))


def errors(T: Array, q: Array) -> tuple[float, float]:
    """Position error [m] and rotation error [rad] of the flange at q against T."""
    reached = forward(q)
    turn = np.linalg.norm(reached[:3, :3] - T[:3, :3]) / np.sqrt(2)
    return float(np.linalg.norm(reached[:3, 3] - T[:3, 3])), float(turn)


def joints(solutions: list[LimitedSolution]) -> Array:
    return np.array([solution.q for solution in solutions])


def pose(position: list[float], rotation: Array | None = None) -> Array:
    T = np.eye(4)
    T[:3, 3] = position
    T[:3, :3] = np.eye(3) if rotation is None else rotation
    return T
