"""Torques of an arm's rigid bodies, and their regressor: the torques are linear in the bodies' ten
parameters each.

Of a body: mass m, first moments m·c (3) and inertia about the joint's frame Ixx, Ixy, Iyy, Ixz,
Iyz, Izz, in the frame of its joint (Pinocchio's order). Rotors are not in them.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint

BODY = 10
"""Parameters of a body."""


def rigid_torques(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Torques (n, nq) [N·m] of rigid bodies, without rotors, at states q, v, a (n, nq)."""
    bare = without_rotors(model)
    data = bare.createData()
    torques = np.empty_like(q)
    for row in range(len(q)):
        torques[row] = pin.rnea(bare, data, q[row], v[row], a[row])
    return torques


def rigid_regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """The matrices (n, nq, 10 nq) whose products with the bodies' parameters are the rigid bodies'
    torques.
    """
    data = model.createData()
    found = np.empty((len(q), model.nq, BODY * model.nq))
    for row in range(len(q)):
        found[row] = pin.computeJointTorqueRegressor(model, data, q[row], v[row], a[row])
    return found


def base_wrench_regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """The matrices (n, 6, 10 nq) whose products with the bodies' parameters are the wrench of the
    links on the base: force [N] and torque [N·m] about its origin, in its axes. Rotors are
    neglected."""
    data = model.createData()
    found = np.empty((len(q), 6, BODY * model.nq))
    for row in range(len(q)):
        checkpoint()
        pin.rnea(model, data, q[row], v[row], a[row])
        pin.forwardKinematics(model, data, q[row])
        for joint in range(1, model.njoints):
            body = pin.jointBodyRegressor(model, data, joint)
            at = slice(BODY * (joint - 1), BODY * joint)
            # minus: what the base exerts on the links acts back on it
            found[row, :, at] = -data.oMi[joint].toDualActionMatrix() @ body
    return found


def without_rotors(model: pin.Model) -> pin.Model:
    """A copy of the model without rotor inertia."""
    bare = model.copy()
    bare.armature = np.zeros(model.nq)
    return bare


def body_parameters(model: pin.Model) -> Array:
    """Parameters (10 nq,) of the model's moving bodies."""
    return np.concatenate([body.toDynamicParameters() for body in list(model.inertias)[1:]])
