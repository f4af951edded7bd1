"""Torques of an arm's rigid bodies, and their regressor.

Torques are linear in ten parameters per body: mass m, first moments m·c (3), and inertia Ixx, Ixy,
Iyy, Ixz, Iyz, Izz about the origin of the joint frame, in the axes of the joint frame and in
Pinocchio's order. Rotors are not included.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint

PARAMETERS_PER_BODY = 10
"""Rigid-body parameters of one body."""


def rigid_torques(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Rigid-body torques (n, nq) [N·m] without rotors, at states q, v, a (n, nq) [rad, rad/s,
    rad/s²].
    """
    bare = without_rotors(model)
    data = bare.createData()
    torques = np.empty_like(q)
    for row in range(len(q)):
        torques[row] = pin.rnea(bare, data, q[row], v[row], a[row])
    return torques


def rigid_regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Matrices (n, nq, 10 nq) that map the parameters of the bodies to the rigid-body torques."""
    data = model.createData()
    regressor = np.empty((len(q), model.nq, PARAMETERS_PER_BODY * model.nq))
    for row in range(len(q)):
        regressor[row] = pin.computeJointTorqueRegressor(model, data, q[row], v[row], a[row])
    return regressor


def base_wrench_regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Matrices (n, 6, 10 nq) that map the parameters of the bodies to the wrench of the links on
    the base.

    The wrench is a force [N] and a torque [N·m] about the origin of the base, in base axes. Rotors
    are neglected.
    """
    data = model.createData()
    regressor = np.empty((len(q), 6, PARAMETERS_PER_BODY * model.nq))
    for row in range(len(q)):
        checkpoint()
        pin.rnea(model, data, q[row], v[row], a[row])
        pin.forwardKinematics(model, data, q[row])
        for joint in range(1, model.njoints):
            body = pin.jointBodyRegressor(model, data, joint)
            columns = slice(PARAMETERS_PER_BODY * (joint - 1), PARAMETERS_PER_BODY * joint)
            # Minus: the wrench on the base opposes the wrench of the base on the links.
            regressor[row, :, columns] = -data.oMi[joint].toDualActionMatrix() @ body
    return regressor


def without_rotors(model: pin.Model) -> pin.Model:
    """Copy of the model without rotor inertia."""
    bare = model.copy()
    bare.armature = np.zeros(model.nq)
    return bare


def body_parameters(model: pin.Model) -> Array:
    """Parameters (10 nq,) of the model's moving bodies."""
    return np.concatenate([body.toDynamicParameters() for body in list(model.inertias)[1:]])
