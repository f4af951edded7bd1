"""Symbolic regressor of the rigid bodies' torques, in CasADi: they are linear in ten parameters of
each body.
"""

from __future__ import annotations

import casadi as ca
import pinocchio as pin

from joulepath.optimizer.dynamics.inverse_dynamics import Body, body_torques


def torque_regressor(model: pin.Model, q: ca.SX, v: ca.SX, a: ca.SX, gravity: ca.SX) -> ca.SX:
    """The matrix (nv, 10 nv) whose product with the parameters of all bodies is their torques,
    without rotors.

    Of a body: mass, first moments (3) and inertia Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin of
    its joint frame, as Pinocchio has them. q [rad], v [rad/s], a [rad/s²] (nv,); `gravity` (3,)
    [m/s²] is in the base frame. Raises ValueError if a joint is not revolute about its z axis.
    """
    parameters = ca.SX.sym("parameters", 10 * model.nv)
    bodies = [_body(each) for each in ca.vertsplit(parameters, 10)]
    return ca.jacobian(ca.vertcat(*body_torques(model, q, v, a, gravity, bodies)), parameters)


def _body(parameters: ca.SX) -> Body:
    mass, x, y, z, xx, xy, yy, xz, yz, zz = ca.vertsplit(parameters)
    inertia = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
    return mass, ca.vertcat(x, y, z), inertia
