"""Values of an arm by Pinocchio alone, for comparison."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot


def flange(robot: Robot, q: Array) -> Array:
    """Flange pose T_base_flange (4, 4)."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return np.asarray(data.oMf[robot.model.getFrameId("flange", pin.BODY)].homogeneous)


def torques_of(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Torques (k, nv) of the bodies and rotors of a model in k states."""
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
