"""What the tests of inverse kinematics share: the UR5e's flange by Pinocchio, and tolerances."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.optimizer.moves import ROBOT

IK = required_inverse_kinematics(ROBOT, "goal")
MODEL, DATA = ROBOT.model, ROBOT.model.createData()
FLANGE = MODEL.getFrameId("flange")
LIMITS = ROBOT.limits

# what the product promises of an answer's forward kinematics [m, rad] and of a configuration found
# again [rad]
ACCURACY = 1e-9
FOUND = 1e-6
# of double precision, and of the part of an angle that a limit may cut off an answer on it [m,
# turns]
ROUNDING = 1e-10

EVERYDAY = np.array([0.3, -1.6, 1.9, -1.8, -1.5, 0.2])


def forward(q: Array) -> Array:
    pin.framesForwardKinematics(MODEL, DATA, q)
    return np.array(DATA.oMf[FLANGE].homogeneous)


def jacobian(q: Array) -> Array:
    return np.array(pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL_WORLD_ALIGNED))


def errors(T: Array, q: Array) -> tuple[float, float]:
    """Position [m] and rotation [rad] of the flange at q against T."""
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
